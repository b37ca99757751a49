// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/stored_model.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/mesh_files.h"
#include "pipelines/drawing.h"
#include "pipelines/scan_stage.h"
#include "tests/libmodel/building/planted.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;
using testing::grid_template;

constexpr int kScans = 48;

// Scans of planted modes as registration leaves them; a patch of each is unseen, two have no colours.
class StoredModel : public ::testing::Test {
 protected:
  void SetUp() override {
    Random random(31);
    const Eigen::Index N = reference_.V.rows();
    const Eigen::MatrixXd shape_modes = testing::random_orthonormal(random, 3 * N, 4),
                          colour_modes = 0.04 * testing::random_matrix(random, 2, 3 * N);
    const Faces& F = reference_.levels.back().F;
    for (int i = 0; i < kScans; ++i) {
      ids_.push_back((i < 10 ? "s0" : "s") + std::to_string(i));
      Mesh mesh{reference_.V, F, {}, {}, {}};
      const Eigen::VectorXd moved = 20 * shape_modes * testing::random_matrix(random, 4, 1);
      mesh.V += Eigen::Map<const Vertices>(moved.data(), N, 3);
      std::string origins(static_cast<size_t>(N), 'm'), weights(static_cast<size_t>(N), '9');
      const int first = random.index(static_cast<int>(N) - 30);
      for (int v = first; v < first + 30; ++v)
        origins[static_cast<size_t>(v)] = 'i', weights[static_cast<size_t>(v)] = '0';
      if (i % 24 != 5) {
        const Eigen::RowVectorXd row = (testing::random_matrix(random, 1, 2) * colour_modes).array() + 0.5;
        mesh.colours = Eigen::Map<const Vertices>(row.data(), N, 3).cwiseMax(0).cwiseMin(1);
        for (int v = first; v < first + 30; ++v) mesh.colours.row(v).setConstant(1);
      }
      write_ply(tree_.registered(ids_.back()), mesh);
      write_file(tree_.scan_origins(ids_.back()), origins);
      write_file(tree_.colour_weights(ids_.back()), weights);
    }
  }
  BuildModelResult in_memory(const BuildModelOptions& options = {}) const {
    return build_model(read_registered_set(ids_, reference_, tree_), reference_, options);
  }

  const MultiresTemplate reference_ = grid_template(16);
  TemporaryDirectory folder_;
  const OutputTree tree_{folder_.path()};
  std::vector<std::string> ids_;
};

TEST_F(StoredModel, IsTheModelInMemoryAndLeavesNothingBehind) {
  const BuildModelResult memory = in_memory(), disk = build_stored_model(ids_, reference_, {}, {true, kScans}, tree_);
  EXPECT_EQ(disk.scans, memory.scans);
  EXPECT_EQ(disk.colour_scans, memory.colour_scans);
  ASSERT_EQ(disk.model.shape().mode_count(), memory.model.shape().mode_count());
  ASSERT_EQ(disk.model.colour().mode_count(), memory.model.colour().mode_count());
  EXPECT_LT((disk.model.shape().mean - memory.model.shape().mean).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((disk.model.shape().basis - memory.model.shape().basis).norm(), 1e-4);
  EXPECT_LT((disk.model.colour().basis - memory.model.colour().basis).norm(), 1e-4);
  EXPECT_EQ(disk.summary.fill.sample_shares, memory.summary.fill.sample_shares);
  EXPECT_EQ(disk.summary.fill.worst_sample, memory.summary.fill.worst_sample);
  EXPECT_FALSE(fs::exists(folder_ / "gathering"));
}

TEST_F(StoredModel, LearnsUnseenColoursFromSomeNearlyAsWell) {
  const BuildModelResult memory = in_memory(), disk = build_stored_model(ids_, reference_, {}, {true, 30}, tree_);
  EXPECT_LT((disk.model.shape().basis - memory.model.shape().basis).norm(), 1e-4) << "shapes need no filling";
  EXPECT_LT((disk.model.colour().mean - memory.model.colour().mean).cwiseAbs().maxCoeff(), 0.01);
  BuildModelOptions alone;
  alone.threads = 1;
  const BuildModelResult again = build_stored_model(ids_, reference_, alone, {true, 30}, tree_);
  EXPECT_EQ(again.model.colour().basis, disk.model.colour().basis) << "for any number of threads";
}

TEST_F(StoredModel, CleansUpAfterAFailureAndSaysWhatItCannotDo) {
  write_file(tree_.registered("s07"), "ply\nnot really");
  EXPECT_THROW(build_stored_model(ids_, reference_, {}, {true, 30}, tree_), std::runtime_error);
  EXPECT_FALSE(fs::exists(folder_ / "gathering"));
  BuildModelOptions balanced;
  balanced.gain_balance = GainBalance::exposure;
  EXPECT_THROW(build_stored_model(ids_, reference_, balanced, {true, 30}, tree_), InvalidInput);
}

TEST(GatherPlan, KeepsWithinItsLimitOrSaysWhatWouldDo) {
  EXPECT_FALSE(plan_gathering(60, 29587, 0).on_disk);
  EXPECT_FALSE(plan_gathering(60, 29587, 8).on_disk);
  const GatherPlan large = plan_gathering(10000, 29587, 4);
  EXPECT_TRUE(large.on_disk);
  EXPECT_GE(large.at_hand, 30);
  EXPECT_LE(large.at_hand, 500);
  EXPECT_LE(large.at_hand, plan_gathering(10000, 29587, 8).at_hand);
  for (const double gigabytes : {0.0, 0.5, 2.0}) {
    try {
      plan_gathering(gigabytes == 0 ? 2000000 : 10000, 29587, gigabytes);
      ADD_FAILURE() << gigabytes;
    } catch (const InvalidInput& e) {
      EXPECT_THAT(e.what(), ::testing::HasSubstr("at least")) << gigabytes;
    }
  }
}

TEST(GatherPlan, JobsAreFewerForLargeScansAndLittleMemory) {
  EXPECT_EQ(jobs_within(0, 1000000000, 3), 3);
  EXPECT_EQ(jobs_within(2, 2000000, 3), 3);
  EXPECT_EQ(jobs_within(2, 40000000, 3), 1);
  EXPECT_EQ(jobs_within(0.01, 1000, 8), 1);
}

TEST(DrawIds, DoesNotDependOnWhoElseIsThereUnlessTheyAreDrawn) {
  std::vector<std::string> ids;
  for (int i = 100; i < 200; ++i) ids.push_back("p" + std::to_string(i));
  const std::vector<std::string> drawn = draw_ids(ids, 20);
  EXPECT_EQ(drawn.size(), 20u);
  EXPECT_TRUE(std::is_sorted(drawn.begin(), drawn.end()));
  std::erase_if(ids, [&](const std::string& id) {
    return id > "p150" && std::find(drawn.begin(), drawn.end(), id) == drawn.end();
  });
  EXPECT_EQ(draw_ids(ids, 20), drawn);
  EXPECT_EQ(draw_ids(ids, 1000), ids);
}

}  // namespace
}  // namespace facewright
