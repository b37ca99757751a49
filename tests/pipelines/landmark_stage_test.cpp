// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/landmark_stage.h"

#include <gmock/gmock.h>

#include "libmodel/io/atomic_file.h"
#include "tests/pipelines/scan_folder.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

// Three people: p0 without landmarks, p1 with few, p2 with all; and a ball.
class LandmarkStage : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory;
    write_people(*folder_ / "scans", 4, 3, 1.6);
    fs::create_directories(*folder_ / "truth");
    for (const char* id : {"p0", "p1"})
      fs::copy_file(*folder_ / "scans" / (std::string(id) + ".json"), *folder_ / "truth" / (std::string(id) + ".json"));
    fs::remove(*folder_ / "scans" / "p0.json");
    write_landmarks(*folder_ / "scans" / "p1.json", given());
    write_ply(*folder_ / "scans" / "ball.ply", icosphere(4, 90));
    first_ = new LandmarkStageSummary(run(false));
  }
  static void TearDownTestSuite() {
    delete first_;
    delete folder_;
  }

  static Landmarks truth(const char* id) { return read_landmarks(*folder_ / "truth" / (std::string(id) + ".json")); }
  static Landmarks given() {
    Landmarks few;
    for (const char* name : {"37", "46", "31", "9"}) few[name] = truth("p1").at(name);
    few["31"].stddev = 0.25;
    return few;
  }
  static LandmarkStageSummary run(bool resume, std::vector<ScanFiles>* files = nullptr) {
    std::vector<ScanFiles> found = find_scans(*folder_ / "scans");
    BuildPipelineOptions options;
    options.resume = resume;
    options.jobs = 2;
    const LandmarkStageSummary summary = landmark_stage(&found, default_reference_face(), options, tree(), {});
    if (files) *files = found;
    return summary;
  }
  static OutputTree tree() { return {*folder_ / "out"}; }

  static TemporaryDirectory* folder_;
  static LandmarkStageSummary* first_;
};
TemporaryDirectory* LandmarkStage::folder_ = nullptr;
LandmarkStageSummary* LandmarkStage::first_ = nullptr;

TEST_F(LandmarkStage, FindsWhatIsMissingAndLeavesTheRest) {
  EXPECT_EQ(first_->found, 1);
  EXPECT_EQ(first_->completed, 1);
  EXPECT_EQ(first_->given, 1);
  EXPECT_EQ(first_->by_hand, 0);
  EXPECT_FALSE(fs::exists(tree().landmarks("p2")));
  for (const char* id : {"p0", "p1"}) {
    const Landmarks found = read_landmarks(tree().landmarks(id)), planted = truth(id);
    EXPECT_TRUE(fs::exists(tree().landmark_picture(id)));
    double sum = 0;
    for (int i = 18; i <= 68; ++i)
      sum += (found.at(std::to_string(i)).position - planted.at(std::to_string(i)).position).norm();
    EXPECT_LT(sum / 51, 4) << id << ": mm, on average of the inner landmarks";
  }
}

TEST_F(LandmarkStage, GivenLandmarksKeepTheirDigitsAndDeviations) {
  const Landmarks completed = read_landmarks(tree().landmarks("p1"));
  for (const auto& [name, mark] : given()) {
    EXPECT_EQ(completed.at(name).position, mark.position) << name;
    EXPECT_EQ(completed.at(name).stddev, mark.stddev) << name;
  }
}

TEST_F(LandmarkStage, WhereThereIsNoFaceTheReasonIsGiven) {
  ASSERT_EQ(first_->failed.size(), 1u);
  EXPECT_THAT(first_->failed.at("ball"), HasSubstr("face"));
  EXPECT_TRUE(fs::exists(tree().landmark_picture("ball"))) << "failures have a picture too";
  EXPECT_FALSE(fs::exists(tree().landmarks("ball")));
}

TEST_F(LandmarkStage, ResumingFindsNothingAgainAndSaysTheSame) {
  const std::string before = read_file(tree().landmarks("p0"));
  const fs::file_time_type written = fs::last_write_time(tree().landmarks("p0"));
  std::vector<ScanFiles> files;
  const LandmarkStageSummary again = run(true, &files);
  EXPECT_EQ(again.found, 1);
  EXPECT_EQ(again.completed, 1);
  EXPECT_EQ(fs::last_write_time(tree().landmarks("p0")), written);
  EXPECT_EQ(read_file(tree().landmarks("p0")), before);
  for (const ScanFiles& f : files)
    if (f.id == "p0" || f.id == "p1") {
      EXPECT_EQ(f.landmarks, tree().landmarks(f.id));
    }
  EXPECT_EQ(again.failed, first_->failed);
}

TEST_F(LandmarkStage, CorrectionsByHandStandWhateverIsFoundOrGiven) {
  for (const char* id : {"p0", "p2"}) {
    const std::string before = fs::exists(tree().landmarks(id)) ? read_file(tree().landmarks(id)) : "";
    Landmarks mended = given();
    mended["31"].position[0] += 3;
    write_landmarks(tree().landmarks(id), mended);
    std::vector<ScanFiles> files;
    const LandmarkStageSummary summary = run(true, &files);
    EXPECT_EQ(summary.by_hand, 1) << id;
    EXPECT_EQ(read_landmarks(tree().landmarks(id)).at("31").position, mended.at("31").position);
    for (const ScanFiles& f : files)
      if (f.id == id) {
        EXPECT_EQ(f.landmarks, tree().landmarks(id));
      }
    before.empty() ? static_cast<void>(fs::remove(tree().landmarks(id))) : write_file(tree().landmarks(id), before);
  }
}

}  // namespace
}  // namespace facewright
