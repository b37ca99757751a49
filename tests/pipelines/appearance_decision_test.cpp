// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gmock/gmock.h>

#include <cmath>

#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libregister/registration/appearance_guide.h"
#include "pipelines/level_decision.h"
#include "pipelines/scan_stage.h"
#include "tests/pipelines/scan_folder.h"
#include "tests/support/matchers.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

// Three people scanned coarsely in colour, and the same without.
class AppearanceDecision : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory;
    write_people(*folder_ / "colour", 4, 3, 3);
    std::filesystem::create_directories(*folder_ / "grey");
    for (const ScanFiles& files : find_scans(*folder_ / "colour")) {
      Mesh mesh = read_mesh(files.mesh);
      mesh.colours.resize(0, 3);
      write_ply(*folder_ / "grey" / files.mesh.filename(), mesh);
      std::filesystem::copy_file(*files.landmarks, *folder_ / "grey" / files.landmarks->filename());
    }
    decision_ = new LevelDecision(decide("colour", options(), "first"));
  }
  static void TearDownTestSuite() {
    delete decision_;
    delete folder_;
  }

  static BuildPipelineOptions options() {
    BuildPipelineOptions o;
    o.jobs = 2;
    o.levels = {3448, 6001};
    return o;
  }
  static OutputTree tree(const std::string& name) { return {*folder_ / name}; }
  static LevelDecision decide(const std::string& scans, const BuildPipelineOptions& o, const std::string& name) {
    return decide_levels(default_reference_face(), find_scans(*folder_ / scans), o, tree(name));
  }

  static std::vector<ScanOutcome> process(const std::string& scans, const LevelDecision& d) {
    const AppearanceGuide guide(d.reference, d.appearance);
    std::vector<ScanOutcome> outcomes;
    for (const ScanFiles& files : find_scans(*folder_ / scans))
      outcomes.push_back(process_scan(files, d.reference, guide, "a key", options(), tree(scans + "_out")));
    return outcomes;
  }

  static TemporaryDirectory* folder_;
  static LevelDecision* decision_;
};
TemporaryDirectory* AppearanceDecision::folder_ = nullptr;
LevelDecision* AppearanceDecision::decision_ = nullptr;

TEST_F(AppearanceDecision, KnowsBrowsAndLips) {
  const FaceAppearance& a = decision_->appearance;
  const MultiresTemplate& t = decision_->reference;
  ASSERT_EQ(a.mean.rows(), AppearanceSpace(t).vertex_count());
  ASSERT_EQ(a.deviation.rows(), a.mean.rows());
  EXPECT_TRUE(a.mean.allFinite());
  const auto mean_of = [&](const char* region, int feature) {
    double sum = 0;
    int n = 0;
    for (const int v : t.regions.at(region))
      if (v < a.mean.rows() && std::isfinite(a.deviation(v, feature))) sum += a.mean(v, feature), ++n;
    return sum / n;
  };
  EXPECT_LT(mean_of("left_brow", 0), -0.1) << "brows are dark";
  EXPECT_LT(mean_of("right_brow", 0), -0.1);
  EXPECT_GT(mean_of("lips", 2), mean_of("chin", 2) + 0.05) << "lips are red";
  EXPECT_FALSE(AppearanceGuide(t, a).empty());
}

TEST_F(AppearanceDecision, ResumeKeepsTheAppearanceToTheLastBit) {
  std::filesystem::create_directories(*folder_ / "kept");
  std::filesystem::copy_file(tree("first").hierarchy(), tree("kept").hierarchy());
  BuildPipelineOptions o = options();
  o.resume = true;
  const LevelDecision again = decide_levels(default_reference_face(), {}, o, tree("kept"));
  ASSERT_TRUE(again.summary.kept);
  EXPECT_THAT(again.appearance.mean, SameBytes(decision_->appearance.mean));
  EXPECT_THAT(again.appearance.deviation, SameBytes(decision_->appearance.deviation));
}

TEST_F(AppearanceDecision, AnAppearanceOfAnotherSizeIsMadeAgain) {
  std::filesystem::create_directories(*folder_ / "short");
  std::string text = read_file(tree("first").hierarchy());
  const size_t from = text.find("\"appearance\":[[") + 14, to = text.find("],[", from) + 2;
  text.erase(from, to - from);  // the first row
  write_file(tree("short").hierarchy(), text);
  BuildPipelineOptions o = options();
  o.resume = true;
  const LevelDecision again = decide("colour", o, "short");
  EXPECT_FALSE(again.summary.kept);
  EXPECT_THAT(again.appearance.mean, SameBytes(decision_->appearance.mean));
  EXPECT_TRUE(read_file(tree("short").hierarchy()) == read_file(tree("first").hierarchy()));
}

TEST_F(AppearanceDecision, ScansWithoutColoursAreRegisteredAllTheSame) {
  const LevelDecision d = decide("grey", options(), "grey_levels");
  EXPECT_EQ(d.summary.scans.size(), 3u);
  EXPECT_TRUE(d.summary.mean_as_reference);
  EXPECT_TRUE(d.appearance.empty());
  EXPECT_EQ(read_file(tree("grey_levels").hierarchy()).find("\"appearance\""), std::string::npos);
  for (const ScanOutcome& outcome : process("grey", d)) {
    EXPECT_TRUE(outcome.registered) << outcome.reason;
    EXPECT_EQ(outcome.summary.guided, 0);
  }
  const RegisteredSet set = read_registered_set({"p0", "p1", "p2"}, d.reference, tree("grey_out"));
  EXPECT_EQ(set.shapes.rows(), 3);
  EXPECT_EQ(set.colours.rows(), 0);
}

TEST_F(AppearanceDecision, ScansInColourAreGuided) {
  for (const ScanOutcome& outcome : process("colour", *decision_)) {
    EXPECT_TRUE(outcome.registered) << outcome.reason;
    EXPECT_GT(outcome.summary.guided, 20) << outcome.id;
  }
}

TEST_F(AppearanceDecision, AChangedTextureRegistersAKeptScanAnew) {
  const auto folder = *folder_ / "textured";
  std::filesystem::create_directories(folder);
  const ScanFiles person = find_scans(*folder_ / "colour").front();
  Mesh mesh = read_mesh(person.mesh);
  mesh.colours.resize(0, 3);
  mesh.uv = TexCoords::Constant(mesh.V.rows(), 2, 0.5);
  write_obj(folder / "p0.obj", mesh, ObjMaterial{"skin.png"});
  write_png(folder / "skin.png", Image(4, 4, 3, 200));
  std::filesystem::copy_file(*person.landmarks, folder / "p0.json");
  BuildPipelineOptions o = options();
  o.resume = true;
  const AppearanceGuide guide(decision_->reference, decision_->appearance);
  const auto kept = [&] {
    return process_scan(find_scans(folder).front(), decision_->reference, guide, "a key", o, tree("textured_out")).kept;
  };
  EXPECT_FALSE(kept());
  EXPECT_TRUE(kept());
  write_png(folder / "skin.png", Image(4, 4, 3, 100));
  EXPECT_FALSE(kept());
  EXPECT_TRUE(kept());
}

}  // namespace
}  // namespace facewright
