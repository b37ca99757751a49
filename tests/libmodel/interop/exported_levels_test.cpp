// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/exported_levels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/interop/eos_model.h"
#include "libmodel/interop/export_model.h"
#include "libmodel/interop/gltf.h"
#include "libmodel/interop/level_files.h"
#include "libmodel/interop/npz.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/model/check_model.h"
#include "libmodel/model/landmark_mapper.h"
#include "libmodel/model/model_file.h"
#include "tests/libmodel/interop/resealed_zip.h"
#include "tests/libmodel/model/model_fixtures.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

struct ExportedLevels : ::testing::Test {
  fs::path out = fs::temp_directory_path() / (std::string("facewright_exported_") +
                                              ::testing::UnitTest::GetInstance()->current_test_info()->name());
  MorphableModel model;
  ExportedLevels() {
    fs::remove_all(out);
    save_model(out / "model.h5", MorphableModel(testing::random_parts(7)));
    model = load_model(out / "model.h5");  // as stored: float32
    for (int l = 0; l < model.level_count(); ++l)
      export_level_files(model, l, out / "levels" / std::to_string(model.vertex_count(l)));
    export_all(out / "export", model);
  }
  ~ExportedLevels() override { fs::remove_all(out); }

  std::vector<ExportNesting> proof() const { return exported_nesting(out, level_counts(model)); }
  std::vector<NestingRow> rows() const {
    std::vector<NestingRow> all;
    for (const ExportNesting& e : proof()) all.insert(all.end(), e.rows.begin(), e.rows.end());
    return all;
  }
  void replace(const fs::path& file, const std::string& from, const std::string& to) const {
    std::string text = read_file(out / file);
    const size_t at = text.find(from);
    ASSERT_NE(at, text.npos) << from << " in " << file;
    text.replace(at, from.size(), to);
    write_file(out / file, file.extension() == ".npz" ? testing::resealed(text) : text);
  }
};

std::string bytes_of(float x) { return std::string(reinterpret_cast<const char*>(&x), sizeof x); }

TEST_F(ExportedLevels, NestInEveryFormatWithDeviationZero) {
  EXPECT_EQ(proof().size(), 6u);  // ply, obj, eos, statismo, npz, glb
  const auto all = rows();
  EXPECT_TRUE(all_hold(all));
  EXPECT_EQ(largest_deviation(all), 0);
  for (const NestingRow& row : all) {
    EXPECT_EQ(row.tolerance > 0, row.quantity.find("rotation") != row.quantity.npos) << row.quantity;
  }
}

TEST_F(ExportedLevels, TheProofIsRecordedBesideTheFiles) {
  for (const char* file : {"levels/12/nesting.json", "levels/40/nesting.json", "export/nesting.json"}) {
    const json proof = json::parse(read_file(out / file));
    ASSERT_FALSE(proof.empty()) << file;
    for (const json& row : proof) EXPECT_TRUE(row["nested"]) << file << row;
  }
}

// The folder of a level is compared with the model's numbers, not only with itself.
TEST_F(ExportedLevels, TheRecordComparesTheFilesWithTheModelAndTheNextLevel) {
  const json record = json::parse(read_file(out / "levels/12/nesting.json"));
  const auto has = [&](const std::string& file, int fine, const std::string& what) {
    return std::any_of(record.begin(), record.end(), [&](const json& row) {
      return row["file"] == file && row["coarse"] == 12 && row["fine"] == fine && row["what"] == what;
    });
  };
  for (const int fine : {12, 20})
    for (const char* what : {"positions", "colours", "texture coordinates", "landmark vertices", "landmark places",
                             "regions", "contours", "symmetry", "parents"})
      EXPECT_TRUE(has("mean.ply and companions", fine, what)) << fine << what;
  EXPECT_TRUE(has("mean.obj", 12, "triangles"));
  EXPECT_TRUE(has("model", 20, "shape basis rows"));
}

// Freshly built numbers are float64: what is compared is what float32 keeps of them.
TEST_F(ExportedLevels, AModelThatWasNeverStoredExportsToo) {
  const MorphableModel fresh(testing::random_parts(8));
  for (int l = 0; l < fresh.level_count(); ++l) EXPECT_NO_THROW(export_level_files(fresh, l, out / "fresh")) << l;
  EXPECT_NO_THROW(export_all(out / "fresh", fresh));
}

TEST_F(ExportedLevels, WhatAnEarlierModelLeftIsNoPartOfTheProof) {
  MorphableModelParts parts = testing::random_parts(9);
  parts.mirror.clear();
  parts.parents.clear();
  parts.levels.erase(parts.levels.begin() + 1);
  const MorphableModel other(parts);  // 12 and 40 vertices, other faces; the files of 20 are the first model's
  EXPECT_NO_THROW(export_all(out / "export", other));
  for (int l = 0; l < 2; ++l) export_level_files(other, l, out / "levels" / std::to_string(other.vertex_count(l)));
  EXPECT_TRUE(fs::exists(out / "export/eos_20.bin"));
  EXPECT_FALSE(fs::exists(out / "export/eos_40_symmetry.txt"));
  EXPECT_FALSE(fs::exists(out / "levels/40/parents.json"));
  for (const ExportNesting& e : exported_nesting(out, level_counts(other))) EXPECT_TRUE(all_hold(e.rows)) << e.file;
  EXPECT_FALSE(all_hold(rows())) << "all three together are of two models";
}

TEST_F(ExportedLevels, OneChangedNumberIsFoundInEveryKindOfFile) {
  const auto breaks = [&](const fs::path& file, const std::string& from, const std::string& to) {
    const std::string before = read_file(out / file);
    replace(file, from, to);
    EXPECT_FALSE(all_hold(rows())) << file;
    write_file(out / file, before);
    EXPECT_TRUE(all_hold(rows()));
  };
  const float x = static_cast<float>(model.shape().mean[4]);
  breaks("levels/20/mean.ply", bytes_of(x), bytes_of(x + 0.001f));
  breaks("levels/20/mean.obj", "\nv -", "\nv ");
  breaks("levels/20/contours.json", "[1,15]", "[1,14]");
  breaks("levels/20/regions.json", "[3,4,11,19]", "[3,4,11]");
  breaks("levels/20/landmark_vertices.json", "\"31\":0", "\"31\":1");
  breaks("levels/20/symmetry.txt", "\n4\n3\n6\n", "\n3\n4\n6\n");
  breaks("levels/20/parents.json", "[4,5]", "[4,3]");
  breaks("export/eos_20.bin", bytes_of(x), bytes_of(x + 0.001f));
  breaks("export/eos_20_contours.json", "[1,15]", "[15,1]");
  const std::string next =
      bytes_of(static_cast<float>(model.shape().mean[5]));  // the mean, not the representer's points
  breaks("export/statismo_20.h5", bytes_of(x) + next, bytes_of(x + 0.001f) + next);
  breaks("export/model_20.npz", bytes_of(x), bytes_of(x + 0.001f));
  const float metres = static_cast<float>(model.shape().mean[4] * 1e-3);
  breaks("export/model_20.glb", bytes_of(metres), bytes_of(metres * 1.001f));
}

TEST_F(ExportedLevels, EdgeTopologyThatIsNotTheMeshesIsRefused) {
  replace("levels/20/edge_topology.json", "\"value1\":3", "\"value1\":4");
  EXPECT_THAT([&] { proof(); }, ThrowsMessage<IoError>(HasSubstr("edge_topology.json")));
}

TEST_F(ExportedLevels, MissingAndMalformedFilesAreErrorsThatNameThem) {
  EXPECT_THAT([&] { exported_nesting(out / "levels", level_counts(model)); },
              ThrowsMessage<InvalidInput>(HasSubstr((out / "levels").string())));
  EXPECT_THROW(exported_nesting(out, {13, 21}), InvalidInput) << "no level of another model";
  for (const char* file : {"export/eos_20.bin", "export/model_20.npz", "export/model_20.glb", "levels/20/regions.json",
                           "levels/20/landmark_points.json", "levels/20/mean.ply", "levels/20/mean.obj"}) {
    const std::string whole = read_file(out / file);
    for (const double share : {0.0, 0.3, 0.9}) {
      write_file(out / file, whole.substr(0, static_cast<size_t>(share * static_cast<double>(whole.size()))));
      if (fs::path(file).extension() == ".obj" && share > 0) continue;  // text of fewer lines is a smaller mesh
      EXPECT_THAT([&] { proof(); }, ThrowsMessage<IoError>(HasSubstr(fs::path(file).filename().string())))
          << file << " " << share;
    }
    write_file(out / file, whole);
  }
}

TEST_F(ExportedLevels, ReadersGiveBackWhatWasWritten) {
  const MorphableModel level = orthonormalised(model.level(1));
  for (const MorphableModel& back :
       {read_eos_model(out / "export/eos_20.bin"), read_npz_model(out / "export/model_20.npz")}) {
    EXPECT_EQ(back.faces(), level.faces());
    EXPECT_LT((back.shape().basis - level.shape().basis).cwiseAbs().maxCoeff(), 1e-7);
    EXPECT_EQ(back.shape().mean, level.shape().mean);
    EXPECT_LT((back.uv() - level.uv()).cwiseAbs().maxCoeff(), 1e-15);
    EXPECT_EQ(back.landmarks().at("left_ear").vertex, level.landmarks().at("left_ear").vertex);
    EXPECT_TRUE(back.expression().has_value());
  }
  const MorphableModel glb = read_glb_model(out / "export/model_20.glb");
  EXPECT_LT((glb.shape().mean - level.shape().mean).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_EQ(glb.faces(), level.faces());
}

// One float of a level of the model file: the whole is refused, the check says what and by how much.
TEST_F(ExportedLevels, ABrokenNumberInTheModelFileFailsTheCheckWithItsFigure) {
  for (const ModelCheck& check : check_model_file(out / "model.h5")) EXPECT_TRUE(check.holds) << check.property;
  std::string bytes = read_file(out / "model.h5");
  const Eigen::VectorXf tail = model.shape().mean.segment(48, 12).cast<float>();  // in level 1, beyond level 0
  const size_t at = bytes.find(std::string(reinterpret_cast<const char*>(tail.data()), 48));
  ASSERT_NE(at, bytes.npos);
  bytes.replace(at, 4, bytes_of(tail[0] + 0.5f));
  write_file(out / "model.h5", bytes);
  EXPECT_THROW(load_model(out / "model.h5"), IoError);
  const auto checks = check_model_file(out / "model.h5");
  const auto found = std::find_if(checks.begin(), checks.end(),
                                  [](const ModelCheck& c) { return c.property == "20 in 40: positions"; });
  ASSERT_NE(found, checks.end());
  EXPECT_FALSE(found->holds);
  EXPECT_THAT(found->detail, HasSubstr("0.5"));
}

// Triangles that share an edge three ways are reported, with everything else, and abort nothing.
TEST_F(ExportedLevels, AModelFileThatIsNoManifoldFailsTheCheck) {
  const Eigen::Matrix<int, 3, Eigen::Dynamic, Eigen::RowMajor> cells = model.faces(1).transpose();
  const auto text = [](const auto& m) {
    return std::string(reinterpret_cast<const char*>(m.data()), static_cast<size_t>(m.size()) * sizeof(int));
  };
  auto fan = cells;
  fan.leftCols(3) << 0, 1, 0, 1, 0, 1, 2, 3, 5;
  std::string bytes = read_file(out / "model.h5");
  const size_t at = bytes.find(text(cells));
  ASSERT_NE(at, bytes.npos);
  write_file(out / "model.h5", bytes.replace(at, text(fan).size(), text(fan)));
  const auto checks = check_model_file(out / "model.h5");
  const auto fails = [&](const std::string& start) {
    return std::any_of(checks.begin(), checks.end(),
                       [&](const ModelCheck& c) { return !c.holds && c.property.starts_with(start); });
  };
  EXPECT_TRUE(fails("triangles of 20 vertices"));
  EXPECT_TRUE(fails("edge topology of 20 vertices"));
  EXPECT_FALSE(fails("edge topology of 40 vertices"));
}

TEST_F(ExportedLevels, LandmarkMappingLeavesTheJawToTheContours) {
  MorphableModelParts p = model.parts();
  for (const char* name : {"1", "8", "10", "17"}) p.landmarks[name] = p.landmarks["31"];
  write_file(out / "map.txt", eos_landmark_mapping(MorphableModel(p)));
  const std::string text = read_file(out / "map.txt");
  EXPECT_THAT(text, HasSubstr("right = [1, 8]"));
  EXPECT_THAT(text, HasSubstr("left = [10, 17]"));
  const LandmarkMapper mapper = read_landmark_mapping(out / "map.txt");
  EXPECT_TRUE(mapper.vertex("9", p.landmarks).has_value());
  EXPECT_FALSE(mapper.vertex("8", p.landmarks).has_value());
}

}  // namespace
}  // namespace facewright
