// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// A folder with everything people drop into one: what is no scan is explained, and changes nothing for those that are.
#include <gmock/gmock.h>

#include <limits>
#include <sstream>

#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/model/model_file.h"
#include "pipelines/build_pipeline.h"
#include "pipelines/output_tree.h"
#include "tests/pipelines/scan_folder.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

constexpr int kPeople = 3;

// Each has the landmarks of p0 beside it, unless they are what is wrong.
class AwkwardFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    write_people(folder_ / "good", 1, kPeople, 2.5);
    fs::copy(folder_ / "good", folder_ / "all");
    write_shapes();
    write_other_files();
    write_landmark_files();
  }

  fs::path all(const std::string& name) const { return folder_ / "all" / name; }
  std::string person(const std::string& name) const { return read_file(folder_ / "good" / name); }
  void refused(const std::string& file, const std::string& bytes) {
    write_file(all(file), bytes);
    refused_.push_back(fs::path(file).stem().string());
    const fs::path marks = all(refused_.back() + ".json");
    if (!fs::exists(marks)) write_file(marks, person("p0.json"));
  }
  void refused(const std::string& id, const Mesh& mesh) {
    write_ply(all("draft.ply"), mesh);
    const std::string bytes = read_file(all("draft.ply"));
    fs::remove(all("draft.ply"));
    refused(id + ".ply", bytes);
  }

  void write_shapes() {
    write_ball(folder_ / "all");
    refused_.push_back("ball");
    refused("wall", plane_grid(20, 20, 250, 250));
    Mesh cube = icosphere(4, 100);
    for (Eigen::Index i = 0; i < cube.V.rows(); ++i) cube.V.row(i) *= 100 / cube.V.row(i).cwiseAbs().maxCoeff();
    refused("cube", cube);
    Mesh far = icosphere(3, 90);
    far.V.rowwise() += Eigen::RowVector3d(1e6, 0, 0);
    refused("elsewhere", far);
    Mesh tiny = icosphere(3, 0.001);
    refused("1 mm tall", tiny);
    refused("huge", icosphere(3, 1e6));
    refused("one", icosphere(0, 1e-9));
  }
  void write_other_files() {
    const std::string scan = person("p0.ply");
    refused("empty.ply", "");
    refused("empty too.obj", "");
    refused("cut.ply", scan.substr(0, scan.size() / 2));
    refused("header.ply", scan.substr(0, scan.find("end_header")));
    refused("boast.ply",
            "ply\nformat ascii 1.0\nelement vertex 999999999\nproperty float x\nproperty float y\n"
            "property float z\nend_header\n0 0 0\n");
    refused("points.obj", "v 0 0 0\nv 100 0 0\nv 0 100 0\n");
    refused("triangle.obj", "v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 3\n");
    refused("beyond.obj", "v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 9\n");
    refused("letter.obj", "Dear Sir or Madam,\nplease find enclosed\n");
    refused("nan.obj", "v nan nan nan\nv inf 0 0\nv 0 nan 0\nf 1 2 3\n");
    refused("archive.stl", std::string("PK\x03\x04", 4) + std::string(100, 'x'));
    refused("noise.glb", std::string(400, '\xa7'));
    refused("solid.stl", "solid nothing\nendsolid nothing\n");
    refused("Zoë's 3. scan (neu).off", "OFF\n0 0 0\n");
    write_png(folder_ / "picture.png", Image(64, 64, 3, 7));
    refused("picture.obj", read_file(folder_ / "picture.png"));
  }
  void write_landmark_files() {
    write_file(all("torn marks.json"), R"({"31": [1, 2)");
    write_file(all("text marks.json"), "none today");
    write_file(all("empty marks.json"), "");
    write_file(all("flat marks.json"), R"({"31": [1, 2], "37": "left"})");
    std::string far = "{";
    for (int i = 1; i <= 68; ++i)
      far += (i > 1 ? ", \"" : "\"") + std::to_string(i) + "\": [" + std::to_string(9 * i) + ", 0, 0]";
    write_file(all("line marks.json"), far + "}");
    for (const char* id : {"torn marks", "text marks", "empty marks", "flat marks", "line marks"})
      refused(std::string(id) + ".ply", person("p0.ply"));
  }

  BuildPipelineSummary build(const std::string& scans, const std::string& output) const {
    BuildPipelineOptions o;
    o.scans = folder_ / scans;
    o.output = folder_ / output;
    o.jobs = 2;
    o.find_landmarks = false;  // landmark_stage_test.cpp
    o.levels = {3448, 6001};   // quickly registered
    return build_from_scans(o);
  }

  TemporaryDirectory folder_;
  std::vector<std::string> refused_;
};

TEST_F(AwkwardFolder, EachIsExplainedAndTheOthersAreRegisteredToTheSameBytes) {
  ASSERT_GE(refused_.size(), 27u);
  const BuildPipelineSummary summary = build("all", "mixed");
  EXPECT_EQ(summary.failed, static_cast<int>(refused_.size()));
  EXPECT_EQ(summary.registered, kPeople);
  const OutputTree mixed{folder_ / "mixed"}, alone{folder_ / "alone"};
  for (const std::string& id : refused_) {
    ASSERT_TRUE(fs::exists(mixed.problem(id))) << id;
    EXPECT_GT(read_file(mixed.problem(id)).size(), 40u) << id;
    EXPECT_FALSE(fs::exists(mixed.registered(id))) << id;
  }
  EXPECT_EQ(build("good", "alone").registered, kPeople);
  for (int i = 0; i < kPeople; ++i) {
    const std::string id = "p" + std::to_string(i);
    EXPECT_TRUE(read_file(mixed.registered(id)) == read_file(alone.registered(id))) << id;
  }
  const MorphableModel one = load_model(mixed.model()),
                       other = load_model(alone.model());  // cards name what is left out
  EXPECT_TRUE(one.shape().basis == other.shape().basis && one.shape().mean == other.shape().mean);
  EXPECT_TRUE(one.colour().basis == other.colour().basis && one.colour().mean == other.colour().mean);
  EXPECT_TRUE(one.levels().back().F == other.levels().back().F);
}

}  // namespace
}  // namespace facewright
