// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/import_model.h"

#include <gmock/gmock.h>

#include "libmodel/core/errors.h"
#include "libmodel/interop/eos_companions.h"
#include "libmodel/interop/export_model.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/model/model_file.h"
#include "libmodel/render/sampling.h"
#include "tests/libmodel/interop/foreign_files.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

struct ImportModel : ::testing::Test {
  TemporaryDirectory folder;
  MorphableModelParts parts = testing::face_sheet_parts(9);
  MorphableModel model{parts};
  Random random{4};

  // Largest difference of random faces, mm.
  double difference(const MorphableModel& other) {
    double worst = 0;
    for (int i = 0; i < 5; ++i) {
      const Eigen::VectorXd c = model.shape().draw_coefficients(random);
      worst = std::max(worst, (model.instance(c).V - other.instance(c).V).cwiseAbs().maxCoeff());
    }
    return worst;
  }
  double expression_difference(const MorphableModel& other) {
    const Eigen::Vector2d e(1, -1.5);
    return (model.instance({}, {}, -1, e).V - other.instance({}, {}, -1, e).V).cwiseAbs().maxCoeff();
  }
};

TEST_F(ImportModel, EveryExportComesBackAsTheSameFaces) {
  for (const std::string format : {"npz", "statismo", "glb", "flame"}) {
    const auto file = folder / ("model." + format);
    export_model(file, model, 0, export_format(format));
    const ImportResult result = import_model(file);
    EXPECT_LT(difference(result.model), 2e-4) << format;
    EXPECT_LT(expression_difference(result.model), 2e-4) << format;
    EXPECT_EQ(result.model.faces(), model.faces()) << format;
    EXPECT_LT((result.model.uv() - model.uv()).cwiseAbs().maxCoeff(), 1e-6) << format;
    EXPECT_EQ(result.model.landmarks().at("31").vertex, model.landmarks().at("31").vertex) << format;
    EXPECT_FALSE(result.decisions.empty());
    if (format == "statismo") continue;
    ASSERT_EQ(result.model.blendshapes().size(), 2u) << format;
    EXPECT_EQ(result.model.blendshapes()[1].name, "jaw open");
    EXPECT_LT((result.model.blendshapes()[1].displacement - parts.blendshapes[1].displacement).cwiseAbs().maxCoeff(),
              1e-4);
  }
}

TEST_F(ImportModel, MeshesOfTheMeanCarryItsColoursAsTexture) {
  export_model(folder / "mean.obj", model, 0, ExportFormat::obj, {.texture_size = 256});
  EXPECT_EQ(texture_file(folder / "mean.obj"), folder / "mean.png");
  const Image texture = read_image(folder / "mean.png");
  const Mesh mean = model.mean();
  double worst = 0;  // at vertices inside the map; neighbours mix in by what a texel spans
  for (Eigen::Index v = 14; v < 14 + 11; ++v) {
    const Eigen::Vector2d p = texel_position(mean.uv.row(v).transpose(), 256, 256);
    worst = std::max(worst, (sample_linear(texture, p) - mean.colours.row(v).transpose()).cwiseAbs().maxCoeff());
  }
  EXPECT_LT(worst, 0.08);
}

TEST_F(ImportModel, EosComesBackChecked) {
  parts.blendshapes.clear();
  model = MorphableModel(parts);
  export_model(folder / "face.bin", model, 0, ExportFormat::eos);
  const ImportResult result = import_model(folder / "face.bin");
  EXPECT_LT(difference(result.model), 2e-4);
  EXPECT_LT((result.model.colour().mean - parts.colour.mean).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_THAT(result.decisions, Contains(HasSubstr("mm as the format defines")));
}

TEST_F(ImportModel, BlendshapesBesideAnEosModelComeAlong) {
  const std::vector<Blendshape> shapes = parts.blendshapes;
  parts.blendshapes.clear();
  export_model(folder / "face.bin", MorphableModel(parts), 0, ExportFormat::eos);
  write_file(folder / "shapes.bin", eos_blendshapes_bytes(shapes));
  const ImportResult result = import_model(folder / "face.bin", {.blendshapes = folder / "shapes.bin"});
  ASSERT_EQ(result.model.blendshapes().size(), shapes.size());
  EXPECT_EQ(result.model.blendshapes()[1].name, shapes[1].name);
  EXPECT_LT((result.model.blendshapes()[1].displacement - shapes[1].displacement).cwiseAbs().maxCoeff(), 1e-4);
  write_file(folder / "other.bin", eos_blendshapes_bytes({{"short", Eigen::VectorXd::Zero(9)}}));
  EXPECT_THAT([&] { import_model(folder / "face.bin", {.blendshapes = folder / "other.bin"}); },
              ThrowsMessage<IoError>(HasSubstr("other.bin")));
  export_model(folder / "model.npz", model, 0, export_format("npz"));
  EXPECT_THROW(import_model(folder / "model.npz", {.blendshapes = folder / "shapes.bin"}), InvalidInput);
}

TEST_F(ImportModel, MatlabFilesOfEveryVersionAreTheSameModel) {
  for (const mat_ft version : {MAT_FT_MAT5, MAT_FT_MAT73})
    for (const matio_compression packed : {MAT_COMPRESSION_NONE, MAT_COMPRESSION_ZLIB}) {
      testing::write_mat(folder / "bfm.mat", testing::bfm_variables(parts), version, packed);
      const ImportResult result = import_model(folder / "bfm.mat");
      EXPECT_LT(difference(result.model), 1e-9);
      EXPECT_EQ(result.model.faces().cast<int>().rows(), model.faces().rows());
      EXPECT_THAT(result.decisions,
                  AllOf(Contains(HasSubstr("squared")), Contains(HasSubstr("um to mm")),
                        Contains(HasSubstr("triangles turned")), Contains(HasSubstr("count from 1"))));
    }
}

TEST_F(ImportModel, FoldersOfMeshesKeepTheirExpressionsByName) {
  testing::write_ict(folder / "ict", parts);
  const ImportResult result = import_model(folder / "ict");
  EXPECT_LT(difference(result.model), 1e-6);
  ASSERT_EQ(result.model.blendshapes().size(), 2u);
  EXPECT_EQ(result.model.blendshapes()[1].name, "smile");
}

TEST_F(ImportModel, AnImportedModelIsStoredAndRemembersItsDecisions) {
  write_file(folder / "face.scm", testing::scm_bytes(parts));
  save_model(folder / "model.h5", import_model(folder / "face.scm").model);
  const MorphableModel back = load_model(folder / "model.h5");
  EXPECT_LT(difference(back), 2e-4);
  EXPECT_THAT(back.provenance().at("import_decisions"), HasSubstr("variances given: kept"));
  EXPECT_EQ(back.level_count(), 1);
}

TEST_F(ImportModel, UnitsFollowFromTheHeightAndFromTheUser) {
  auto variables = testing::bfm_variables(parts);
  variables["shapeMU"] /= 1000;  // millimetres, unlike the format
  variables["shapeEV"] /= 1000;
  testing::write_mat(folder / "mm.mat", variables);
  const ImportResult found = import_model(folder / "mm.mat");
  EXPECT_LT(difference(found.model), 1e-9);
  EXPECT_THAT(found.decisions, Contains(HasSubstr("though the format's are um")));
  variables["shapeMU"] *= 3.7;  // 740 mm
  testing::write_mat(folder / "giant.mat", variables);
  EXPECT_THAT([&] { import_model(folder / "giant.mat"); }, ThrowsMessage<IoError>(HasSubstr("--units")));
  EXPECT_NO_THROW(import_model(folder / "giant.mat", {.units = "mm"}));
}

TEST_F(ImportModel, SigmaTakenForVarianceIsNoticed) {
  auto variables = testing::bfm_variables(parts);
  variables["shapeEV"] = (variables["shapeEV"] / 1000).cwiseAbs2() * 1e6;  // variances where sigma belongs
  testing::write_mat(folder / "odd.mat", variables);
  EXPECT_THAT([&] { import_model(folder / "odd.mat"); },
              ThrowsMessage<IoError>(HasSubstr("--values variance or --values sigma")));
  EXPECT_LT(difference(import_model(folder / "odd.mat", {.values = "variance"}).model), 1e-9);
}

TEST_F(ImportModel, WindingThatNothingTellsIsAsked) {
  auto variables = testing::bfm_variables(parts);
  Eigen::MatrixXd& t = variables["tl"];
  for (Eigen::Index f = 0; f < t.rows(); f += 2) t.row(f).reverseInPlace();
  testing::write_mat(folder / "mixed.mat", variables);
  EXPECT_THAT([&] { import_model(folder / "mixed.mat"); }, ThrowsMessage<IoError>(HasSubstr("--winding")));
  EXPECT_NO_THROW(import_model(folder / "mixed.mat", {.winding = "keep"}));
}

TEST_F(ImportModel, ColumnsThatAreNotOrthogonalKeepTheirFacesOrTheirCoefficients) {
  parts.shape.basis.col(1) = (parts.shape.basis.col(1) + 0.3 * parts.shape.basis.col(0)).normalized();
  parts.shape.orthonormal = false;
  model = MorphableModel(parts);
  testing::write_ict(folder / "ict", parts);
  EXPECT_LT(difference(import_model(folder / "ict", {.keep_columns = true}).model), 1e-6);
  const MorphableModel made = import_model(folder / "ict").model;
  const Eigen::MatrixXd& B = made.shape().basis;
  EXPECT_LT((B.transpose() * B - Eigen::MatrixXd::Identity(B.cols(), B.cols())).norm(), 1e-9);
  const Eigen::VectorXd face = model.shape().instance(Eigen::Vector4d(1, 2, -1, 0.5));
  EXPECT_LT((made.shape().project(face) - face).norm(), 1e-6);
  const Eigen::MatrixXd W = model.shape().rescaled_basis(), U = made.shape().rescaled_basis();
  EXPECT_LT((W * W.transpose() - U * U.transpose()).norm(), 1e-5) << "the same covariance";
}

TEST_F(ImportModel, ColumnsOfOtherLengthsAreMadeUnitOrKeptAndSaidToBe) {
  auto variables = testing::bfm_variables(parts);
  Eigen::MatrixXd& basis = variables["shapePC"];
  basis.col(1) *= 2;
  variables["shapeEV"](1) /= 2;
  testing::write_mat(folder / "long.mat", variables);
  const ImportResult made = import_model(folder / "long.mat"),
                     kept = import_model(folder / "long.mat", {.keep_columns = true});
  EXPECT_TRUE(made.model.shape().orthonormal);
  EXPECT_NEAR(made.model.shape().basis.col(1).norm(), 1, 1e-9);
  EXPECT_FALSE(kept.model.shape().orthonormal);
  EXPECT_NEAR(kept.model.shape().basis.colwise().norm().maxCoeff(), 2, 1e-3);
  const Eigen::MatrixXd W = made.model.shape().rescaled_basis(), U = kept.model.shape().rescaled_basis();
  EXPECT_LT((W * W.transpose() - U * U.transpose()).norm(), 1e-6 * (W * W.transpose()).norm()) << "the same covariance";
  const auto says = [](const ImportResult& result, const std::string& text) {
    return std::count_if(result.decisions.begin(), result.decisions.end(),
                         [&](const std::string& d) { return d.find(text) != d.npos; });
  };
  EXPECT_EQ(says(made, "columns are not of length 1 (1 to 2): made orthonormal"), 1);
  EXPECT_EQ(says(kept, "columns are not of length 1 (1 to 2), kept as asked"), 1);
}

TEST_F(ImportModel, LeadingVerticesAreTheSameFacesCut) {
  constexpr int kKept = 130;
  testing::write_ict(folder / "ict", parts);
  const MorphableModel part = import_model(folder / "ict", {.units = "cm", .leading_vertices = kKept}).model;
  EXPECT_EQ(part.vertex_count(), kKept);
  const Vertices face = model.instance(Eigen::Vector4d(1, 2, -1, 0.5)).V.topRows(kKept);
  EXPECT_LT((part.project(face) - face).norm(), 1e-5);
  const ImportOptions kept{.units = "cm", .keep_columns = true, .leading_vertices = kKept};
  EXPECT_LT((import_model(folder / "ict", kept).model.instance(Eigen::Vector4d(1, 2, -1, 0.5)).V - face).norm(), 1e-5);
}

TEST_F(ImportModel, OptionsThatMeanNothingAreRefused) {
  EXPECT_THROW(import_model(folder.path(), {.units = "inch"}), InvalidInput);
  EXPECT_THROW(import_model(folder.path(), {.axes = "x y"}), InvalidInput);
  EXPECT_THROW(import_model(folder.path(), {.axes = "x x z"}), InvalidInput);
  EXPECT_THROW(import_model(folder.path(), {.axes = "x y -z"}), InvalidInput) << "a mirror image";
  EXPECT_THROW(import_model(folder / "nothing"), IoError);
  testing::write_mat(folder / "bfm.mat", testing::bfm_variables(parts));
  EXPECT_THROW(import_model(folder / "bfm.mat", {.identity_modes = 3}), InvalidInput) << "FLAME's alone";
}

}  // namespace
}  // namespace facewright
