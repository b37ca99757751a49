// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/model_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/model/hdf5_archive.h"
#include "model_fixtures.h"

namespace facewright {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kFloat = 1e-6;  // relative rounding of float32 storage

struct ModelFile : ::testing::Test {
  std::filesystem::path folder =
      std::filesystem::temp_directory_path() /
      ("facewright_model_file_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) +
       ::testing::UnitTest::GetInstance()->current_test_info()->name());
  std::filesystem::path file = folder / "model.h5";
  ~ModelFile() override { std::filesystem::remove_all(folder); }

  // Loads a file made of a good model's bytes after `spoil`.
  auto loading(const std::string& bytes) {
    write_file(file, bytes);
    return [this] { load_model(file); };
  }
};

TEST_F(ModelFile, KeepsEverythingToFloatPrecision) {
  const MorphableModel model(testing::random_parts(1));
  save_model(file, model);
  const MorphableModel back = load_model(file);
  const MorphableModelParts &a = model.parts(), &b = back.parts();
  for (const auto& [x, y] :
       {std::pair(a.shape, b.shape), std::pair(a.colour, b.colour), std::pair(*a.expression, *b.expression)}) {
    EXPECT_LT((x.mean - y.mean).norm(), kFloat * x.mean.norm());
    EXPECT_LT((x.basis - y.basis).norm(), kFloat * x.basis.norm());
    EXPECT_LT((x.variances - y.variances).norm(), kFloat * x.variances.norm());
    EXPECT_TRUE(y.orthonormal);
  }
  ASSERT_EQ(back.level_count(), 3);
  for (int l = 0; l < 3; ++l) EXPECT_EQ(back.faces(l), model.faces(l));
  EXPECT_EQ(b.uv, a.uv);
  EXPECT_EQ(b.mirror, a.mirror);
  EXPECT_EQ(b.regions, a.regions);
  EXPECT_EQ(b.provenance, a.provenance);
  ASSERT_EQ(b.parents.size(), a.parents.size());
  EXPECT_EQ(b.parents[4].c, a.parents[4].c);
  for (const auto& [name, mark] : a.landmarks) EXPECT_EQ(b.landmarks.at(name).vertex, mark.vertex);
}

TEST_F(ModelFile, SavingALoadedModelReproducesTheBytes) {
  const MorphableModel model(testing::random_parts(2));
  const std::string bytes = serialise_model(model);
  EXPECT_TRUE(bytes == serialise_model(model));
  write_file(file, bytes);
  EXPECT_TRUE(serialise_model(load_model(file)) == bytes);
}

TEST_F(ModelFile, EveryLevelIsAModelOfItsOwn) {
  save_model(file, MorphableModel(testing::random_parts(3)));
  const MorphableModel model = load_model(file);
  Random random(4);
  const Eigen::VectorXd c = model.shape().draw_coefficients(random), d = model.colour().draw_coefficients(random);
  for (int l = 0; l < model.level_count(); ++l) {
    const MorphableModel alone = load_model(file, "/level" + std::to_string(l));
    EXPECT_EQ(alone.instance(c, d).V, model.instance(c, d, l).V);
    EXPECT_EQ(alone.instance(c, d).colours, model.instance(c, d, l).colours);
    EXPECT_EQ(alone.mean().uv, model.mean(l).uv);
    EXPECT_EQ(alone.landmarks().at("9").vertex, model.landmarks().at("9").vertex);
    EXPECT_LT((alone.coefficients(alone.instance(c).V) - c).norm(), 1e-6);
  }
}

TEST_F(ModelFile, FollowsTheStatismoLayout) {
  save_model(file, MorphableModel(testing::random_parts(5)));
  const Hdf5Reader h5(file);
  for (const std::string at : {"", "/level0", "/level2"}) {
    const Eigen::Index n = at == "/level0" ? 12 : 40;
    EXPECT_EQ(h5.integers(at + "/version/minorVersion")(0, 0), 9);
    EXPECT_EQ(h5.matrix(at + "/shape/representer/points").rows(), 3);
    EXPECT_EQ(h5.matrix(at + "/shape/representer/points").cols(), n);
    EXPECT_EQ(h5.integers(at + "/shape/representer/cells").cols(), n - 2);
    EXPECT_EQ(h5.matrix(at + "/shape/model/pcaBasis").rows(), 3 * n);
    EXPECT_EQ(h5.matrix(at + "/color/model/mean").rows(), 3 * n);
    EXPECT_EQ(h5.matrix(at + "/expression/model/noiseVariance").size(), 1);
    EXPECT_EQ(h5.matrix(at + "/color/representer/points"), h5.matrix(at + "/shape/representer/points"));
    EXPECT_EQ(h5.string(at + "/catalog/MorphableModel.shape/modelType"), "POLYGON_MESH_MODEL");
    EXPECT_THAT(h5.string(at + "/metadata/landmarks/json"), HasSubstr("\"coordinates\""));
  }
}

TEST_F(ModelFile, ReadsAShapeOnlyStatismoFileOfVersion08) {
  Random random(6);
  const PcaModel pca = testing::random_pca(random, 30, 3, 5);
  Hdf5Writer h5;
  h5.vector("/model/mean", pca.mean.cast<float>());
  h5.matrix("/model/pcaBasis", RowMatrixXf(pca.rescaled_basis().cast<float>()));
  h5.vector("/model/pcaVariance", pca.variances.cast<float>());
  h5.matrix("/representer/cells", RowMatrixXi(testing::strip(10).transpose()));
  h5.string("/metadata/landmarks/json", R"([{"id":"tip","coordinates":[)" + std::to_string(pca.mean[9]) + "," +
                                            std::to_string(pca.mean[10]) + "," + std::to_string(pca.mean[11]) + "]}]");
  write_file(file, h5.bytes());
  const MorphableModel model = load_model(file);
  EXPECT_LT((model.shape().basis - pca.basis).norm(), 1e-5);
  EXPECT_FALSE(model.has_colour());
  EXPECT_EQ(model.landmarks().at("tip").vertex, 3);
}

TEST_F(ModelFile, KeepsAModelWithoutModes) {
  MorphableModelParts p = testing::random_parts(7);
  p.shape = p.shape.truncated(0);
  p.colour = {};
  p.expression.reset();
  save_model(file, MorphableModel(p));
  EXPECT_EQ(load_model(file).shape().mode_count(), 0);
  EXPECT_FALSE(load_model(file).has_colour());
}

TEST_F(ModelFile, OneBasisThatIsNotOrthonormalDoesNotMakeTheFileUnreadable) {
  MorphableModelParts p = testing::random_parts(8);
  p.expression->basis.col(0) += 0.5 * p.expression->basis.col(1);
  p.expression->orthonormal = false;
  const MorphableModel model(p);
  save_model(file, model);
  const MorphableModel back = load_model(file);
  const Eigen::VectorXd e = Eigen::VectorXd::Ones(p.expression->mode_count());
  EXPECT_LT((back.instance({}, {}, -1, e).V - model.instance({}, {}, -1, e).V).cwiseAbs().maxCoeff(), 1e-4);
}

TEST_F(ModelFile, RefusesWhatIsNotAModel) {
  EXPECT_THAT([&] { load_model(folder / "none.h5"); }, ThrowsMessage<IoError>(HasSubstr("no such file")));
  EXPECT_THAT(loading("not HDF5 at all"), ThrowsMessage<IoError>(HasSubstr("not an HDF5 file")));
  Hdf5Writer other;
  other.scalar("/something", 1);
  EXPECT_THAT(loading(other.bytes()), ThrowsMessage<IoError>(AllOf(HasSubstr("/model/mean"), HasSubstr("missing"))));
}

TEST_F(ModelFile, RefusesTruncatedFiles) {
  const std::string bytes = serialise_model(MorphableModel(testing::random_parts(8)));
  for (double share : {0.0, 0.01, 0.3, 0.9, 0.999})
    EXPECT_THROW(loading(bytes.substr(0, static_cast<size_t>(share * static_cast<double>(bytes.size()))))(), IoError);
}

TEST_F(ModelFile, RefusesInconsistentContent) {
  Random random(9);
  const PcaModel pca = testing::random_pca(random, 30, 3, 5);
  const auto file_with = [&](auto change) {
    PcaModel p = pca;
    Faces F = testing::strip(10);
    change(p, F);
    Hdf5Writer h5;
    h5.vector("/model/mean", p.mean.cast<float>());
    h5.matrix("/model/pcaBasis", RowMatrixXf(p.basis.cast<float>()));
    h5.vector("/model/pcaVariance", p.variances.cast<float>());
    h5.matrix("/representer/cells", RowMatrixXi(F.transpose()));
    h5.scalar("/version/majorVersion", 0);
    h5.scalar("/version/minorVersion", 9);
    return h5.bytes();
  };
  EXPECT_NO_THROW(loading(file_with([](auto&, auto&) {}))());
  EXPECT_THAT(loading(file_with([](auto& p, auto&) { p.basis = p.basis.topRows(27).eval(); })),
              ThrowsMessage<IoError>(AllOf(HasSubstr("27 x 3"), HasSubstr("30 x 3"))));
  EXPECT_THAT(loading(file_with([](auto& p, auto&) { p.mean[4] = std::nan(""); })),
              ThrowsMessage<IoError>(HasSubstr("NaN")));
  EXPECT_THAT(loading(file_with([](auto& p, auto&) { p.variances[0] = -1; })),
              ThrowsMessage<IoError>(HasSubstr("variance")));
  EXPECT_THAT(loading(file_with([](auto&, auto& F) { F(2, 1) = 10; })), ThrowsMessage<IoError>(HasSubstr("triangle")));
}

// Whatever is wrong, the message names the file and the dataset, and nothing is read or written out of bounds.
TEST_F(ModelFile, RefusesTablesAndJsonOfAnotherKindByName) {
  Random random(11);
  const PcaModel pca = testing::random_pca(random, 30, 3, 5);
  const auto file_with = [&](auto change) {
    Hdf5Writer h5;
    h5.vector("/model/mean", pca.mean.cast<float>());
    h5.matrix("/model/pcaBasis", RowMatrixXf(pca.basis.cast<float>()));
    h5.vector("/model/pcaVariance", pca.variances.cast<float>());
    change(h5);
    return h5.bytes();
  };
  const auto refuses = [&](const std::string& dataset, const std::string& what, auto change) {
    EXPECT_THAT(loading(file_with(change)),
                ThrowsMessage<IoError>(AllOf(HasSubstr(file.string()), HasSubstr(dataset), HasSubstr(what))));
  };
  const auto cells = [](Hdf5Writer& h5) {
    h5.matrix("/representer/cells", RowMatrixXi(testing::strip(10).transpose()));
  };
  const std::string legacy = "/representer/reference-mesh/triangle-list";
  for (const int columns : {1, 2, 4})
    refuses(legacy, std::to_string(columns) + " columns; expected 3",
            [&](Hdf5Writer& h5) { h5.matrix(legacy, RowMatrixXi(RowMatrixXi::Zero(8, columns))); });
  EXPECT_NO_THROW(loading(file_with([&](Hdf5Writer& h5) { h5.matrix(legacy, RowMatrixXi(testing::strip(10))); }))());
  refuses("/version/majorVersion", "expected one", [&](Hdf5Writer& h5) {
    cells(h5);
    h5.vector("/version/majorVersion", std::vector<std::int32_t>{});
    h5.scalar("/version/minorVersion", 9);
  });
  const std::string coordinates = "/metadata/landmarks/json", places = "/metadata/ext/landmark_points";
  for (const char* text :
       {"[1]", "3", "{\"a\": 1}", R"([{"id": 3, "coordinates": [1, 2, 3]}])", R"([{"id": "a", "coordinates": "x"}])",
        R"([{"id": "a", "coordinates": [1, 2]}])", R"([{"coordinates": [1, 2, 3]}])"})
    refuses(coordinates, "unexpected content", [&](Hdf5Writer& h5) {
      cells(h5);
      h5.string(coordinates, text);
    });
  for (const char* text : {"3", "[3]", R"({"31": 3})", R"({"31": {"barycentric": [1, 0]}})",
                           R"({"31": {"barycentric": [1, 0, 0], "triangle": "x"}})"})
    refuses(places, "unexpected content", [&](Hdf5Writer& h5) {
      cells(h5);
      h5.string(places, text);
    });
}

TEST_F(ModelFile, RefusesLevelsThatDoNotNest) {
  std::string bytes = serialise_model(MorphableModel(testing::random_parts(10)));
  // Change one float of level 1's mean: the only run of bytes equal to its values 30..36 beyond level 0's.
  const MorphableModel model(testing::random_parts(10));
  const Eigen::VectorXf tail = model.shape().mean.segment(48, 12).cast<float>();
  const std::string needle(reinterpret_cast<const char*>(tail.data()), 48);
  const size_t at = bytes.find(needle);
  ASSERT_NE(at, std::string::npos);
  bytes[at + 1] = static_cast<char>(bytes[at + 1] ^ 0x10);
  EXPECT_THAT(loading(bytes), ThrowsMessage<IoError>(HasSubstr("do not nest")));
}

}  // namespace
}  // namespace facewright
