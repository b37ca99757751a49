// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/build_pipeline.h"

#include <gmock/gmock.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"
#include "pipelines/output_tree.h"
#include "tests/pipelines/scan_folder.h"
#include "tests/support/matchers.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

// Four people scanned coarsely, and three files that no model can be made of.
class BuildPipeline : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory;
    write_people(scans(), 1, 4, 2.5);
    write_ball(scans());  // landmarks of a face on something that is none
    std::ofstream(scans() / "broken.ply") << "ply\nformat ascii 1.0\nelement vertex 9\n";
    write_ply(scans() / "unmarked.ply", icosphere(4, 90));
    summary_ = new BuildPipelineSummary(build_from_scans(build_options("out")));
  }
  static void TearDownTestSuite() {
    delete summary_;
    delete folder_;
  }

  static fs::path scans() { return *folder_ / "scans"; }
  static BuildPipelineOptions build_options(const std::string& output, int jobs = 2) {
    BuildPipelineOptions o;
    o.scans = scans();
    o.output = *folder_ / output;
    o.jobs = jobs;
    o.find_landmarks = false;  // landmark_stage_test.cpp
    return o;
  }
  static OutputTree tree() { return {*folder_ / "out"}; }

  static TemporaryDirectory* folder_;
  static BuildPipelineSummary* summary_;
};
TemporaryDirectory* BuildPipeline::folder_ = nullptr;
BuildPipelineSummary* BuildPipeline::summary_ = nullptr;

TEST_F(BuildPipeline, RegistersThePeopleAndExplainsTheRest) {
  EXPECT_EQ(summary_->registered, 4);
  EXPECT_EQ(summary_->failed, 3);
  for (const char* id : {"broken", "unmarked", "ball"}) {
    EXPECT_TRUE(fs::exists(tree().problem(id))) << id;
    EXPECT_FALSE(fs::exists(tree().registered(id))) << id;
  }
  EXPECT_THAT(read_file(tree().problem("unmarked")), ::testing::HasSubstr("landmarks"));
  EXPECT_THAT(read_file(tree().problem("broken")), ::testing::HasSubstr("broken.ply"));
}

TEST_F(BuildPipeline, LeavesAModelWhoseLevelsNest) {
  const MorphableModel model = load_model(tree().model());
  ASSERT_EQ(model.level_count(), 3);
  const int counts[] = {3448, 16759, 29587};
  for (int l = 0; l < 3; ++l) {
    EXPECT_EQ(model.vertex_count(l), counts[l]);
    EXPECT_THAT(model.mean(l).V, SameBytes(Vertices(model.mean().V.topRows(counts[l]))));
    EXPECT_TRUE(fs::exists(tree().level(counts[l]) / "mean.ply"));
    EXPECT_TRUE(fs::exists(tree().level(counts[l]) / "isomap.png"));
  }
  EXPECT_EQ(model.shape().variances.size(), 3);  // four faces span three directions
  EXPECT_EQ(model.uv().rows(), 29587);
}

TEST_F(BuildPipeline, LevelsHoldOneFolderPerVertexCountAndNothingElse) {  // scripts list them
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(tree().level(3448).parent_path()))
    names.push_back(entry.path().filename().string());
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("3448", "16759", "29587"));
}

TEST_F(BuildPipeline, RegistrationsLieOnTheirScans) {
  for (const ScanOutcome& o : summary_->scans) {
    if (!o.registered) continue;
    EXPECT_LT(o.summary.surface_mean, 0.05) << o.id;  // mm, to the denoised scan
    EXPECT_LT(o.summary.fold_percent, 0.05) << o.id;
    EXPECT_LT(o.summary.landmark_mean, 2.0) << o.id;  // planted landmark noise is 1 mm
  }
}

TEST_F(BuildPipeline, OneThreadGivesTheSameBytes) {
  build_from_scans(build_options("one", 1));
  const OutputTree one{*folder_ / "one"};
  EXPECT_EQ(read_file(one.model()), read_file(tree().model()));
  for (const char* id : {"p0", "p1", "p2", "p3"})
    EXPECT_EQ(read_file(one.registered(id)), read_file(tree().registered(id)));
}

TEST_F(BuildPipeline, ResumeKeepsWhatIsUnchangedAndForgetsWhatIsGone) {
  fs::copy(*folder_ / "out", *folder_ / "again", fs::copy_options::recursive);
  BuildPipelineOptions o = build_options("again");
  o.resume = true;
  std::ofstream(OutputTree{o.output}.registered("stranger")) << "left over";
  std::ofstream(o.output / "scans" / "notes.md") << "a user's own file";
  const BuildPipelineSummary s = build_from_scans(o);
  for (const ScanOutcome& outcome : s.scans) EXPECT_EQ(outcome.kept, outcome.registered) << outcome.id;
  EXPECT_EQ(read_file(OutputTree{o.output}.model()), read_file(tree().model()));
  EXPECT_FALSE(fs::exists(OutputTree{o.output}.registered("stranger")));
  EXPECT_TRUE(fs::exists(o.output / "scans" / "notes.md"));
  o.registration.use_mirror = false;  // a changed option makes all of it anew
  for (const ScanOutcome& outcome : build_from_scans(o).scans) EXPECT_FALSE(outcome.kept) << outcome.id;
}

// Every file of a folder with the time it was written at.
std::map<std::string, fs::file_time_type> stamps(const fs::path& folder) {
  std::map<std::string, fs::file_time_type> times;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) times[entry.path().string()] = entry.last_write_time();
  return times;
}

TEST_F(BuildPipeline, ASecondRunWritesNothingUnlessAFileWasHarmed) {
  BuildPipelineOptions o = build_options("still");
  build_from_scans(o);
  const auto before = stamps(o.output);
  o.resume = true;
  const BuildPipelineSummary s = build_from_scans(o);
  EXPECT_TRUE(s.nothing_changed);
  EXPECT_EQ(stamps(o.output), before);
  EXPECT_EQ(s.shape_modes, summary_->shape_modes);
  EXPECT_EQ(s.level_vertices, summary_->level_vertices);
  std::ofstream(OutputTree{o.output}.model(), std::ios::app) << "x";
  EXPECT_FALSE(build_from_scans(o).nothing_changed);
  EXPECT_EQ(read_file(OutputTree{o.output}.model()), read_file(tree().model()));
  o.seed = 2;  // of the report's pictures
  EXPECT_FALSE(build_from_scans(o).nothing_changed);
}

TEST_F(BuildPipeline, PartsSideBySideMakeTheSameModel) {
  BuildPipelineOptions o = build_options("parts");
  o.part = {1, 2};
  o.until = BuildStage::registration;
  EXPECT_THROW(build_from_scans(o), InvalidInput);  // the levels are not decided
  o.part = {};
  o.until = BuildStage::levels;
  build_from_scans(o);
  EXPECT_FALSE(fs::exists(OutputTree{o.output}.registered("p0")));
  o.until = BuildStage::registration;
  o.part = {1, 2};
  BuildPipelineOptions other = o;
  other.criterion = LevelCriterion::bend;  // decided otherwise than the parts would be registered
  const std::string decided = read_file(OutputTree{o.output}.hierarchy());
  EXPECT_THROW(build_from_scans(other), InvalidInput);
  EXPECT_EQ(read_file(OutputTree{o.output}.hierarchy()), decided);
  int scans = 0;
  for (const int part : {2, 1}) {
    o.part = {part, 2};
    scans += static_cast<int>(build_from_scans(o).scans.size());
  }
  EXPECT_EQ(scans, static_cast<int>(summary_->scans.size()));
  EXPECT_FALSE(fs::exists(OutputTree{o.output}.model()));
  o.until = BuildStage::model;
  EXPECT_THROW(build_from_scans(o), InvalidInput);  // not in parts
  o.part = {};
  o.resume = true;
  for (const ScanOutcome& outcome : build_from_scans(o).scans) EXPECT_EQ(outcome.kept, outcome.registered);
  EXPECT_EQ(read_file(OutputTree{o.output}.model()), read_file(tree().model()));
}

TEST_F(BuildPipeline, WhatProgressThrowsEndsTheBuildAndLosesNothing) {
  BuildPipelineOptions o = build_options("stopped", 1);
  int registered = 0;
  const Progress stop = [&](const ProgressEvent& event) {
    if (event.stage == "registering" && event.done > 0 && ++registered == 3) throw std::runtime_error("enough");
  };
  EXPECT_THROW(build_from_scans(o, stop), std::runtime_error);
  EXPECT_FALSE(fs::exists(OutputTree{o.output}.model()));
  o.resume = true;
  int kept = 0;
  for (const ScanOutcome& outcome : build_from_scans(o).scans) kept += outcome.kept;
  EXPECT_GT(kept, 0);
  EXPECT_EQ(read_file(OutputTree{o.output}.model()), read_file(tree().model()));
}

TEST_F(BuildPipeline, NeverWritesOverTheScansThemselves) {
  BuildPipelineOptions o = build_options("unused");
  o.output = folder_->path();  // the scans are in its folder "scans"
  const std::string landmarks = read_file(scans() / "p0.json");
  EXPECT_THROW(build_from_scans(o), InvalidInput);
  EXPECT_EQ(read_file(scans() / "p0.json"), landmarks);
}

TEST_F(BuildPipeline, TooFewScansAreAnErrorThatTellsWhereToLook) {
  BuildPipelineOptions o = build_options("few");
  o.least_scans = 5;
  try {
    build_from_scans(o);
    FAIL() << "four scans made a model that needed five";
  } catch (const InvalidInput& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("problematic"));
  }
  EXPECT_TRUE(fs::exists(OutputTree{o.output}.build_json()));
}

}  // namespace
}  // namespace facewright
