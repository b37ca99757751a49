// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/interop/eos_model.h"
#include "libmodel/interop/export_model.h"
#include "libmodel/interop/gltf.h"
#include "libmodel/interop/level_files.h"
#include "libmodel/interop/npz.h"
#include "libmodel/interop/uv_wireframe.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/check_model.h"
#include "libmodel/model/landmark_mapper.h"
#include "libmodel/model/model_file.h"
#include "tests/libmodel/model/model_fixtures.h"

namespace facewright {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

MorphableModel model_without_expression() {
  MorphableModelParts p = testing::random_parts(1);
  p.expression.reset();
  p.blendshapes.clear();
  return MorphableModel(p);
}

// Reads plain values back, as an independent reader of a format would.
struct Reader {
  const std::string& bytes;
  size_t at = 0;
  template <class T>
  T value() {
    T x{};
    if (at + sizeof(T) > bytes.size()) throw std::out_of_range("end of file");
    std::memcpy(&x, bytes.data() + at, sizeof(T));
    at += sizeof(T);
    return x;
  }
  Eigen::MatrixXf matrix() {
    const auto rows = value<std::int32_t>(), cols = value<std::int32_t>();
    Eigen::MatrixXf m(rows, cols);
    for (int c = 0; c < cols; ++c)
      for (int r = 0; r < rows; ++r) m(r, c) = value<float>();
    return m;
  }
  Eigen::MatrixXi triangles() {
    Eigen::MatrixXi F(value<std::uint64_t>(), 3);
    for (int f = 0; f < F.rows(); ++f)
      for (int k = 0; k < 3; ++k) F(f, k) = value<std::int32_t>();
    return F;
  }
};

struct Files : ::testing::Test {
  fs::path folder = fs::temp_directory_path() / (std::string("facewright_interop_") +
                                                 ::testing::UnitTest::GetInstance()->current_test_info()->name());
  ~Files() override { fs::remove_all(folder); }
};

TEST(EosModel, ReadsBackFieldByField) {
  const MorphableModel model = orthonormalised(model_without_expression().level(1));
  const std::string bytes = eos_model_bytes(model);
  Reader in{bytes};
  EXPECT_EQ(in.value<std::uint32_t>(), 4u);
  for (const PcaModel& pca : {model.shape(), model.colour()}) {
    EXPECT_EQ(in.matrix(), pca.mean.cast<float>());
    const Eigen::MatrixXf basis = in.matrix();
    EXPECT_EQ(basis, pca.basis.cast<float>());
    EXPECT_LT((basis.transpose() * basis - Eigen::MatrixXf::Identity(basis.cols(), basis.cols())).norm(), 1e-5);
    EXPECT_EQ(in.matrix(), pca.variances.cast<float>());
    EXPECT_EQ(in.triangles(), Eigen::MatrixXi(model.faces()));
  }
  EXPECT_EQ(in.value<std::uint8_t>(), 1);  // no expressions
  EXPECT_EQ(in.value<std::uint8_t>(), 0);  // landmarks
  const auto count = in.value<std::uint64_t>();
  ASSERT_EQ(count, model.landmarks().size());
  for (std::uint64_t i = 0; i < count; ++i) {
    std::string name(in.value<std::uint64_t>(), ' ');
    for (char& c : name) c = in.value<char>();
    EXPECT_EQ(in.value<std::int32_t>(), model.landmarks().at(name).vertex);
  }
  ASSERT_EQ(in.value<std::uint64_t>(), 20u);
  for (int v = 0; v < 20; ++v) {
    EXPECT_EQ(in.value<double>(), model.uv()(v, 0));
    EXPECT_EQ(in.value<double>(), 1 - model.uv()(v, 1));
  }
  EXPECT_EQ(in.value<std::uint64_t>(), 0u);
  EXPECT_EQ(in.at, bytes.size());
}

TEST(EosModel, Version1HasTheSizeOfTheSurreyModelsLayout) {
  MorphableModelParts p = testing::random_parts(2);
  p.colour = {};
  const MorphableModel model = MorphableModel(p).level(2);
  const size_t n = 40, k = 5, t = 38;
  const size_t shape = 8 + 4 * 3 * n + 8 + 4 * 3 * n * k + 8 + 4 * k + 8 + 12 * t;
  EXPECT_EQ(eos_model_bytes(model, 1).size(), 4 + shape + 32 + 8 + 16 * n);
}

TEST(EosModel, RefusesSeveralLevelsAndUnknownVersions) {
  const MorphableModel model = model_without_expression();
  EXPECT_THROW(eos_model_bytes(model), InvalidInput);
  EXPECT_THROW(eos_model_bytes(model.level(0), 2), InvalidInput);
}

TEST(Npz, IsAnArchiveOfArraysWithTheModelsBytes) {
  const MorphableModel model = model_without_expression().level(0);
  const std::string bytes = npz_bytes(model);
  EXPECT_EQ(bytes.substr(0, 4), "PK\x03\x04");
  EXPECT_EQ(bytes.substr(bytes.size() - 22, 4), "PK\x05\x06");
  const Eigen::VectorXf mean = model.shape().mean.cast<float>();
  EXPECT_NE(bytes.find(std::string(reinterpret_cast<const char*>(mean.data()), 4 * 36)), std::string::npos);
  EXPECT_NE(bytes.find("'shape': (12,3)"), std::string::npos);
  EXPECT_EQ(bytes, npz_bytes(model));
}

TEST(Glb, DescribesItsBinaryChunk) {
  const MorphableModel model = model_without_expression().level(1);
  const std::string bytes = glb_bytes(model, {.modes = 3});
  Reader in{bytes};
  EXPECT_EQ(in.value<std::uint32_t>(), 0x46546c67u);
  EXPECT_EQ(in.value<std::uint32_t>(), 2u);
  EXPECT_EQ(in.value<std::uint32_t>(), bytes.size());
  const auto length = in.value<std::uint32_t>();
  const json gltf = json::parse(bytes.substr(20, length));
  EXPECT_EQ(gltf["meshes"][0]["primitives"][0]["targets"].size(), 3u);
  EXPECT_EQ(gltf["meshes"][0]["extras"]["targetNames"][2], "shape 3");
  const size_t total = gltf["buffers"][0]["byteLength"];
  EXPECT_EQ(20 + length + 8 + total, bytes.size());
  for (const json& view : gltf["bufferViews"])
    EXPECT_LE(view["byteOffset"].get<size_t>() + view["byteLength"].get<size_t>(), total);
  EXPECT_EQ(gltf["accessors"][0]["count"], 20);
}

TEST_F(Files, StatismoExportIsAModelWithAnOrthonormalBasis) {
  const MorphableModel model = model_without_expression();
  export_model(folder / "level.h5", model, 0, ExportFormat::statismo);
  const MorphableModel back = load_model(folder / "level.h5");
  EXPECT_EQ(back.level_count(), 1);
  EXPECT_TRUE(back.shape().orthonormal);
  const Eigen::Index k = back.shape().mode_count();
  EXPECT_LT((back.shape().basis.transpose() * back.shape().basis - Eigen::MatrixXd::Identity(k, k)).norm(), 1e-5);
  // The same Gaussian: the covariance of the vertices is the row block of the finest level's.
  const Eigen::MatrixXd W = model.shape().rescaled_basis().topRows(36), U = back.shape().rescaled_basis();
  EXPECT_LT((W * W.transpose() - U * U.transpose()).norm(), 1e-5 * (W * W.transpose()).norm());
}

TEST_F(Files, SharedBasisKeepsTheMeaningOfCoefficients) {
  const MorphableModel model = model_without_expression();
  export_model(folder / "level.h5", model, 0, ExportFormat::statismo, {.basis = ExportBasis::shared});
  const Eigen::Vector3d c(1, -1, 0.5);
  EXPECT_LT((load_model(folder / "level.h5").instance(c).V - model.instance(c, {}, 0).V).norm(), 1e-4);
}

TEST_F(Files, MeshExportsCarryTheMeanWithTextureCoordinates) {
  const MorphableModel model = model_without_expression();
  export_model(folder / "mean.obj", model, 1, ExportFormat::obj);
  export_model(folder / "mean.ply", model, 1, ExportFormat::ply);
  const Mesh mean = model.mean(1);
  for (const char* name : {"mean.obj", "mean.ply"}) {
    const Mesh back = read_mesh(folder / name);
    EXPECT_LT((back.V - mean.V).norm(), 1e-4) << name;
    EXPECT_EQ(back.F, mean.F) << name;
    ASSERT_EQ(back.uv.rows(), mean.uv.rows()) << name;
    EXPECT_LT((back.uv - mean.uv).norm(), 1e-5) << name;
  }
  EXPECT_THROW(export_format("stl"), InvalidInput);
  EXPECT_EQ(export_format("glb"), ExportFormat::glb);
}

TEST_F(Files, ExportAllWritesEveryLevelInEveryFormat) {
  export_all(folder, model_without_expression());
  for (const std::string v : {"12", "20", "40"})
    for (const std::string& name : {"eos_" + v + ".bin", "eos_" + v + "_landmarks.txt", "statismo_" + v + ".h5",
                                    "model_" + v + ".npz", "model_" + v + ".glb"})
      EXPECT_TRUE(fs::exists(folder / name)) << name;
  EXPECT_EQ(read_landmark_mapping(folder / "eos_12_landmarks.txt").vertex("31", {}), 0);
}

TEST_F(Files, LevelFilesSayWhatTheModelSays) {
  const MorphableModel model = model_without_expression();
  export_level_files(model, 1, folder);
  for (const char* name : {"mean.ply", "mean.obj", "isomap.png", "landmarks.json", "symmetry.txt", "parents.json"})
    EXPECT_TRUE(fs::exists(folder / name)) << name;
  EXPECT_EQ(json::parse(read_file(folder / "landmark_vertices.json"))["31"], 0);
  EXPECT_EQ(json::parse(read_file(folder / "contours.json"))["model_contour"]["left_contour"], json({1, 15}));
  const json parents = json::parse(read_file(folder / "parents.json"));
  EXPECT_EQ(parents["first_vertex"], 6);
  EXPECT_EQ(parents["parents"].size(), 14u);
  const json topology = json::parse(read_file(folder / "edge_topology.json"))["edge_topology"];
  const auto all = edges(model.faces(1));
  ASSERT_EQ(topology["adjacent_vertices"].size(), all.size());
  for (size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(topology["adjacent_vertices"][i]["value0"], all[i].v0 + 1);
    EXPECT_EQ(topology["adjacent_faces"][i]["value0"] == 0, all[i].is_boundary());
  }
  EXPECT_EQ(symmetry_text({1, 0, 2}, 3), "2 # symmetric counterpart of each vertex, 1-based\n1\n3\n");
}

TEST_F(Files, ChecksHoldForASavedModelAndFailForABrokenOne) {
  MorphableModelParts parts = testing::random_parts(3);
  save_model(folder / "model.h5", MorphableModel(parts));
  for (const ModelCheck& check : check_model_file(folder / "model.h5")) EXPECT_TRUE(check.holds) << check.property;
  parts.shape.basis.col(1) = parts.shape.basis.col(0);
  const auto checks = check_model(MorphableModel(parts));
  EXPECT_FALSE(checks.front().holds);
}

TEST(UvWireframe, DrawsEdgesDarkAndLeavesTheRestWhite) {
  TexCoords uv(3, 2);
  uv << 0.1, 0.1, 0.9, 0.1, 0.1, 0.9;
  Faces F(1, 3);
  F << 0, 1, 2;
  const Image image = uv_wireframe(uv, F, 100);
  EXPECT_LT(*image.pixel(50, 90), 200);  // the lower edge, v = 0.1
  EXPECT_EQ(*image.pixel(25, 70), 255);
  EXPECT_EQ(*image.pixel(90, 10), 255);
  EXPECT_THROW(uv_wireframe(uv.topRows(2), F, 100), InvalidInput);
}

}  // namespace
}  // namespace facewright
