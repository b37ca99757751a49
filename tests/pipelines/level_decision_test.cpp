// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/level_decision.h"

#include <gmock/gmock.h>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "tests/pipelines/scan_folder.h"
#include "tests/support/matchers.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

// Three people scanned coarsely, and something that is no face.
class LevelDecisionTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory;
    write_people(scans(), 2, 3, 3);
    write_ball(scans());
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::filesystem::path scans() { return *folder_ / "scans"; }
  static OutputTree tree(const std::string& name) { return {*folder_ / name}; }
  static BuildPipelineOptions small(int jobs = 2) {
    BuildPipelineOptions o;
    o.jobs = jobs;
    o.levels = {3448, 6001};  // coarse: quickly registered
    return o;
  }
  static LevelDecision decide(const BuildPipelineOptions& o, const std::string& name) {
    return decide_levels(default_reference_face(), find_scans(scans()), o, tree(name));
  }

  static TemporaryDirectory* folder_;
};
TemporaryDirectory* LevelDecisionTest::folder_ = nullptr;

TEST_F(LevelDecisionTest, MeasuresWhatCanBeRegisteredOnAnyNumberOfThreads) {
  const LevelDecision two = decide(small(), "two"), one = decide(small(1), "one");
  EXPECT_THAT(two.summary.scans, UnorderedElementsAre("p0", "p1", "p2"));
  EXPECT_THAT(two.summary.left_out, ElementsAre("ball"));
  EXPECT_EQ(two.summary.criterion, LevelCriterion::deviation);
  EXPECT_TRUE(read_file(tree("one").hierarchy()) == read_file(tree("two").hierarchy()));
  EXPECT_EQ(two.reference.levels.back().vertex_count, 6001);
  EXPECT_NO_THROW(mirrored_triangles(two.reference.levels.back().F, two.reference.mirror));
}

TEST_F(LevelDecisionTest, TheFacesMeanBecomesASymmetricReferenceInTheHeadFrame) {
  const LevelDecision d = decide(small(), "mean");
  EXPECT_TRUE(d.summary.mean_as_reference);
  const MultiresTemplate own = default_reference();
  const Eigen::Index n = own.levels.front().vertex_count;  // the base: the same vertices in both
  const Vertices motion = d.reference.V.topRows(n) - own.V.topRows(n);
  EXPECT_GT(motion.rowwise().norm().maxCoeff(), 0.5) << "three people are not the reference";
  EXPECT_LT(motion.rowwise().norm().mean(), 8) << "but faces in its frame";
  for (Eigen::Index i = 0; i < d.reference.V.rows(); ++i) {
    const Eigen::RowVector3d x = d.reference.V.row(i);
    const Eigen::RowVector3d twin = d.reference.V.row(d.reference.mirror[static_cast<size_t>(i)]);
    ASSERT_EQ(x, Eigen::RowVector3d(-twin[0], twin[1], twin[2])) << i;
  }
}

TEST_F(LevelDecisionTest, KeepsTheReferencesShapeOnRequest) {
  BuildPipelineOptions o = small();
  o.mean_as_reference = false;
  const LevelDecision d = decide(o, "own");
  EXPECT_FALSE(d.summary.mean_as_reference);
  const Eigen::Index n = default_reference_face().mesh.vertex_count();
  EXPECT_THAT(Vertices(d.reference.V.topRows(n)), SameBytes(default_reference_face().mesh.V));
}

TEST_F(LevelDecisionTest, StandsForScansThatComeLater) {
  BuildPipelineOptions o = small();
  const LevelDecision first = decide(o, "kept");
  o.resume = true;
  const LevelDecision again = decide_levels(default_reference_face(), {}, o, tree("kept"));  // other scans
  EXPECT_TRUE(again.summary.kept);
  EXPECT_EQ(again.summary.scans, first.summary.scans);
  EXPECT_THAT(again.reference.V, SameBytes(first.reference.V));
  EXPECT_EQ(again.reference.mirror, first.reference.mirror);
  EXPECT_EQ(again.reference.regions, first.reference.regions);
  for (size_t l = 0; l < first.reference.levels.size(); ++l)
    EXPECT_TRUE(again.reference.levels[l].F == first.reference.levels[l].F);
  o.levels = {3448, 6003};  // another question
  EXPECT_FALSE(decide_levels(default_reference_face(), {}, o, tree("kept")).summary.kept);
}

TEST_F(LevelDecisionTest, IsMadeAgainForOtherOptionsOfTheRegistration) {
  BuildPipelineOptions o = small();
  decide(o, "options");
  o.resume = true;
  o.registration.landmark_stddev = 2;
  EXPECT_FALSE(decide(o, "options").summary.kept);
}

TEST_F(LevelDecisionTest, RefusesLevelsThatDoNotIncreaseBeforeItReadsAScan) {
  BuildPipelineOptions o = small();
  o.levels = {3448, 100};
  int reports = 0;
  EXPECT_THROW(decide_levels(default_reference_face(), find_scans(scans()), o, tree("falling"),
                             [&](const ProgressEvent&) { ++reports; }),
               InvalidInput);
  EXPECT_EQ(reports, 0);
}

TEST_F(LevelDecisionTest, IsMadeAgainIfItsFileIsDamaged) {
  BuildPipelineOptions o = small();
  o.criterion = LevelCriterion::length;
  decide(o, "damaged");
  const std::string whole = read_file(tree("damaged").hierarchy());
  o.resume = true;
  EXPECT_TRUE(decide(o, "damaged").summary.kept);
  std::string wrong = whole;
  wrong.replace(wrong.rfind("],["), 3, "],[0,");
  for (const std::string& bytes : {whole.substr(0, whole.size() / 2), wrong, std::string("{}")}) {
    write_file(tree("damaged").hierarchy(), bytes);
    EXPECT_FALSE(decide(o, "damaged").summary.kept);
    EXPECT_TRUE(read_file(tree("damaged").hierarchy()) == whole);
  }
}

TEST_F(LevelDecisionTest, FallsBackOnTheReferenceWithoutEnoughScansAndAsksAgainNextTime) {
  BuildPipelineOptions o = small();
  std::vector<ScanFiles> files = find_scans(scans());
  files.resize(2);
  const LevelDecision alone = decide_levels(default_reference_face(), files, o, tree("few"));
  EXPECT_EQ(alone.summary.criterion, LevelCriterion::bend);
  EXPECT_TRUE(alone.reference.levels.back().F == build_template(default_reference_face(), o.levels).levels.back().F);
  o.resume = true;
  const LevelDecision later = decide(o, "few");
  EXPECT_FALSE(later.summary.kept);
  EXPECT_EQ(later.summary.criterion, LevelCriterion::deviation);
}

TEST_F(LevelDecisionTest, ASingleLevelNeedsNoScans) {
  BuildPipelineOptions o = small();
  o.levels = {3448};
  const LevelDecision d = decide(o, "single");
  EXPECT_THAT(d.summary.scans, IsEmpty());
  EXPECT_EQ(d.reference.levels.back().F.rows(), 6736);
}

}  // namespace
}  // namespace facewright
