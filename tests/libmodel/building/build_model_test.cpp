// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/build_model.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "libmodel/core/errors.h"
#include "planted.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using testing::grid_template;
using testing::random_motion;

Eigen::VectorXd ones(const MultiresTemplate& t) { return Eigen::VectorXd::Ones(t.V.rows()); }

Eigen::RowVectorXd row_of(const Vertices& V) { return Eigen::Map<const Eigen::RowVectorXd>(V.data(), V.size()); }

// Smooth deformations of the grid, `modes` of them.
RegisteredSet random_set(Random& random, const MultiresTemplate& t, int scans, int modes) {
  RegisteredSet set;
  const Eigen::Index d = t.V.size();
  const Eigen::MatrixXd basis = testing::random_orthonormal(random, d, modes);
  set.shapes = 15 * testing::random_matrix(random, scans, modes) * basis.transpose();
  set.shapes.rowwise() += row_of(t.V);
  set.colours = 0.5 + (2 * testing::random_matrix(random, scans, modes) * basis.transpose()).array() * 0.2;
  for (int i = 0; i < scans; ++i) set.ids.push_back(std::to_string(i));
  return set;
}

TEST(GeneralisedProcrustes, RemovesRigidMotion) {
  const MultiresTemplate t = grid_template(9);
  Random random(1);
  SampleMatrix shapes(12, t.V.size());
  for (int i = 0; i < 12; ++i) shapes.row(i) = row_of(random_motion(random).apply(t.V));
  const ProcrustesResult result = generalised_procrustes(shapes, ones(t), t.V);
  EXPECT_TRUE(result.summary.converged);
  EXPECT_LT((result.shapes.rowwise() - row_of(t.V)).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT(result.summary.rms, 1e-9);
}

TEST(GeneralisedProcrustes, ResultDoesNotDependOnTheFramesOfTheScans) {
  const MultiresTemplate t = grid_template(7);
  Random random(2);
  const RegisteredSet set = random_set(random, t, 8, 4);
  SampleMatrix moved = set.shapes;
  for (int i = 0; i < 8; ++i) moved.row(i) = row_of(random_motion(random).apply(set.vertices(i)));
  const ProcrustesResult a = generalised_procrustes(set.shapes, ones(t), t.V);
  const ProcrustesResult b = generalised_procrustes(moved, ones(t), t.V);
  EXPECT_LT((a.shapes - b.shapes).cwiseAbs().maxCoeff(), 1e-5);  // both stop within 1e-6 of the fixed point
}

TEST(GeneralisedProcrustes, FixedScaleKeepsSizeAndFreeScaleRemovesIt) {
  const MultiresTemplate t = grid_template(7);
  SampleMatrix shapes(3, t.V.size());
  for (int i = 0; i < 3; ++i) shapes.row(i) = row_of((1 + 0.1 * i) * t.V);
  const auto fixed = generalised_procrustes(shapes, ones(t), t.V, {.scaling = Scaling::fixed});
  const auto free = generalised_procrustes(shapes, ones(t), t.V, {.scaling = Scaling::free});
  EXPECT_GT(fixed.summary.rms, 1);
  EXPECT_LT(free.summary.rms, 1e-9);
  for (const auto& motion : fixed.mean_from_scans) EXPECT_EQ(motion.s, 1);
  const Vertices centred = free.mean.rowwise() - free.mean.colwise().mean();
  const Vertices expected = 1.1 * (t.V.rowwise() - t.V.colwise().mean());
  EXPECT_LT((centred - expected).norm(), 1e-6);
}

TEST(GeneralisedProcrustes, ReportsTheMotionOfEachScan) {
  const MultiresTemplate t = grid_template(7);
  Random random(3);
  const RegisteredSet set = random_set(random, t, 5, 3);
  const ProcrustesResult result = generalised_procrustes(set.shapes, ones(t), t.V);
  for (int i = 0; i < 5; ++i)
    EXPECT_LT((result.shapes.row(i) - row_of(result.mean_from_scans[i].apply(set.vertices(i)))).norm(), 1e-8);
}

TEST(FillUnseen, RecoversWhatALowRankModelDetermines) {
  Random random(4);
  const auto planted = testing::planted_gaussian(random, 80, 240, 4);
  SampleMatrix visibility = SampleMatrix::Ones(80, 80), values = planted.samples;
  for (int i = 0; i < 80; ++i)
    for (int v = 0; v < 20; ++v) {
      const int unseen = (v + 3 * i) % 80;
      visibility(i, unseen) = 0;
      values.row(i).segment<3>(3 * unseen).setConstant(1e4);  // must never be used
    }
  FillUnseenOptions options;
  options.max_iterations = 300;
  options.modes = 4;
  const FillUnseenResult filled = fill_unseen(values, visibility, options);
  EXPECT_NEAR(filled.summary.filled_share, 0.25, 1e-12);
  EXPECT_LT((filled.values - planted.samples).norm(), 1e-2 * (planted.samples.rowwise() - planted.mean).norm());
}

TEST(FillUnseen, LeavesSeenValuesAlone) {
  Random random(5);
  const auto planted = testing::planted_gaussian(random, 10, 60, 3);
  SampleMatrix visibility = SampleMatrix::Ones(10, 20);
  EXPECT_EQ(fill_unseen(planted.samples, visibility).values, planted.samples);
  visibility(2, 7) = 0;
  visibility.col(11).setZero();
  const FillUnseenResult filled = fill_unseen(planted.samples, visibility);
  EXPECT_EQ(filled.summary.never_seen, 1);
  EXPECT_EQ(filled.summary.worst_sample, 2);
  SampleMatrix difference = filled.values - planted.samples;
  difference.row(2).segment<3>(21).setZero();
  EXPECT_EQ(difference.norm(), 0);
  EXPECT_TRUE(filled.values.allFinite());
}

TEST(BuildModel, RecoversThePlantedShapeSpace) {
  const MultiresTemplate t = grid_template(9);
  Random random(6);
  const RegisteredSet set = random_set(random, t, 40, 5);
  const BuildModelResult built = build_model(set, t);
  EXPECT_EQ(built.summary.shape.mode_count, built.model.shape().mode_count());
  EXPECT_GE(built.summary.shape_shares.back(), 0.99);
  EXPECT_EQ(built.model.level_count(), 1);
  EXPECT_EQ(built.model.landmarks().at("31").vertex, t.levels[0].F(0, 1));
  for (int i = 0; i < 40; ++i) {
    const Vertices aligned = built.mean_from_scans[i].apply(set.vertices(i));
    const double residual = (built.model.project(aligned) - aligned).norm();
    EXPECT_LT(residual, 0.5 * (aligned - built.model.mean().V).norm());
    EXPECT_LT((built.model.coefficients(aligned) - built.shape_scores.row(i).transpose()).norm(), 1e-6);
  }
}

TEST(BuildModel, DoesNotDependOnTheFramesOfTheScans) {
  const MultiresTemplate t = grid_template(7);
  Random random(7);
  RegisteredSet set = random_set(random, t, 10, 4);
  const BuildModelResult a = build_model(set, t);
  for (int i = 0; i < 10; ++i) set.shapes.row(i) = row_of(random_motion(random).apply(set.vertices(i)));
  const BuildModelResult b = build_model(set, t);
  EXPECT_LT((a.model.shape().mean - b.model.shape().mean).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_LT((a.model.shape().variances - b.model.shape().variances).norm(), 1e-4 * a.model.shape().variances[0]);
}

TEST(BuildModel, OneScanIsAModelWithoutModes) {
  const MultiresTemplate t = grid_template(5);
  Random random(8);
  RegisteredSet set = random_set(random, t, 1, 2);
  const BuildModelResult built = build_model(set, t);
  EXPECT_EQ(built.model.shape().mode_count(), 0);
  EXPECT_TRUE(built.model.mean().V.allFinite());
  Random other(1);
  EXPECT_EQ(built.model.sample(other).V, built.model.mean().V);
}

TEST(BuildModel, PruningLeavesOutTheFailedRegistrationAndAlignsAnew) {
  const MultiresTemplate t = grid_template(9);
  Random random(18);
  RegisteredSet set = random_set(random, t, 120, 5);
  set.shapes.row(77) += 80 * testing::random_matrix(random, 1, t.V.size());
  BuildModelOptions options;
  options.prune_quantile = 0.9999;
  const BuildModelResult pruned = build_model(set, t, options), whole = build_model(set, t);
  ASSERT_FALSE(pruned.summary.pruned.removed.empty());
  EXPECT_EQ(pruned.summary.pruned.removed[0].sample, 77);
  EXPECT_LE(pruned.summary.pruned.removed.size(), 4U);  // motion makes the tails of small modes heavy
  EXPECT_EQ(pruned.scans, pruned.summary.pruned.kept);
  RegisteredSet rest;
  rest.shapes = set.shapes(pruned.scans, Eigen::all);
  rest.colours = set.colours(pruned.scans, Eigen::all);
  const BuildModelResult expected = build_model(rest, t);
  EXPECT_EQ(pruned.model.shape().basis, expected.model.shape().basis);
  EXPECT_EQ(pruned.colour_scores, expected.colour_scores);
  EXPECT_EQ(whole.scans.size(), 120U);
  EXPECT_TRUE(whole.summary.pruned.kept.empty());
}

TEST(BuildModel, ScansWithoutColoursAreInTheShapeModelOnly) {
  const MultiresTemplate t = grid_template(9);
  Random random(19);
  RegisteredSet set = random_set(random, t, 12, 3);
  set.colour_weights = SampleMatrix::Ones(12, t.V.rows());
  for (const int s : {2, 7}) set.colour_weights.row(s).setZero(), set.colours.row(s).setZero();
  const BuildModelResult built = build_model(set, t);
  EXPECT_EQ(built.scans.size(), 12U);
  EXPECT_EQ(built.colour_scans, (std::vector<int>{0, 1, 3, 4, 5, 6, 8, 9, 10, 11}));
  RegisteredSet coloured;
  coloured.shapes = set.shapes(built.colour_scans, Eigen::all);
  coloured.colours = set.colours(built.colour_scans, Eigen::all);
  EXPECT_EQ(built.model.colour().mean, build_model(coloured, t).model.colour().mean);
  set.colour_weights.setZero();
  EXPECT_FALSE(build_model(set, t).model.has_colour());
  set.colour_weights.resize(12, 3);
  EXPECT_THROW(build_model(set, t), InvalidInput);
}

TEST(BuildModel, SimilarityAlignmentReportsScalesAndTakesSizeOutOfTheModel) {
  const MultiresTemplate t = grid_template(9);
  RegisteredSet set;
  set.shapes.resize(10, t.V.size());
  for (int i = 0; i < 10; ++i) set.shapes.row(i) = row_of((1 + 0.02 * i) * t.V);
  BuildModelOptions options;
  options.scaling = Scaling::free;
  const BuildModelResult fixed = build_model(set, t), free = build_model(set, t, options);
  EXPECT_EQ(fixed.model.shape().mode_count(), 1);
  EXPECT_EQ(free.model.shape().mode_count(), 0);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(fixed.mean_from_scans[i].s, 1);
    EXPECT_NEAR(free.mean_from_scans[i].s * (1 + 0.02 * i), 1.09, 1e-9);
  }
}

TEST(BuildModel, OnDiskItIsTheModelInMemory) {
  const MultiresTemplate t = grid_template(9);
  Random random(19);
  const RegisteredSet set = random_set(random, t, 40, 5);
  const BuildModelResult memory = build_model(set, t);
  const TemporaryDirectory folder;
  SampleStore shapes = SampleStore::create(folder / "shapes", row_of(t.V));
  SampleStore colours = SampleStore::create(folder / "colours", Eigen::RowVectorXd::Constant(t.V.size(), 0.5));
  shapes.append(set.ids, set.shapes);
  colours.append(set.ids, set.colours);
  const BuildModelResult disk = build_model(shapes, &colours, t);
  ASSERT_EQ(disk.model.shape().mode_count(), memory.model.shape().mode_count());
  EXPECT_LT((disk.model.shape().mean - memory.model.shape().mean).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_LT((disk.model.shape().basis - memory.model.shape().basis).norm(), 1e-5);  // rows are float32
  EXPECT_LT((disk.model.colour().basis - memory.model.colour().basis).norm(), 1e-5);
  EXPECT_LT((disk.shape_scores - memory.shape_scores).norm(), 1e-4);
}

TEST(BuildModel, OnDiskPrunesWeighsWhatWasSeenAndTakesColoursOfSome) {
  const MultiresTemplate t = grid_template(9);
  Random random(23);
  RegisteredSet set = random_set(random, t, 40, 5);
  set.shapes.row(7) += 30 * row_of(testing::random_matrix(random, t.V.rows(), 3));
  set.visibility = SampleMatrix::NullaryExpr(40, t.V.rows(), [&] { return random.uniform(0, 1) < 0.3 ? 0.0 : 1.0; });
  set.colour_weights = SampleMatrix::Ones(40, t.V.rows());
  set.colour_weights.row(3).setZero();
  BuildModelOptions options;
  options.prune_quantile = 0.99;
  options.prune_modes = 3;
  const BuildModelResult memory = build_model(set, t, options);
  ASSERT_FALSE(memory.summary.pruned.removed.empty());
  const TemporaryDirectory folder;
  SampleStore shapes = SampleStore::create(folder / "shapes", row_of(t.V));
  SampleStore colours = SampleStore::create(folder / "colours", Eigen::RowVectorXd::Constant(t.V.size(), 0.5));
  shapes.append(set.ids, set.shapes);
  for (Eigen::Index i = 0; i < 40; ++i)
    if (i != 3) colours.append({set.ids[static_cast<size_t>(i)]}, set.colours.row(i));
  const BuildModelResult disk = build_model(shapes, &colours, t, options, [&](const std::string& id) {
    return Eigen::VectorXd(set.visibility.row(std::find(set.ids.begin(), set.ids.end(), id) - set.ids.begin()));
  });
  EXPECT_EQ(disk.scans, memory.scans);
  EXPECT_EQ(disk.colour_scans, memory.colour_scans);
  EXPECT_NEAR(disk.summary.procrustes.unseen_share, memory.summary.procrustes.unseen_share, 1e-9);
  ASSERT_EQ(disk.model.shape().mode_count(), memory.model.shape().mode_count());
  EXPECT_LT((disk.model.shape().mean - memory.model.shape().mean).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((disk.model.shape().basis - memory.model.shape().basis).norm(), 1e-4);
  EXPECT_LT((disk.model.colour().basis - memory.model.colour().basis).norm(), 1e-4);
  SampleStore strange = SampleStore::create(folder / "strange", Eigen::RowVectorXd::Constant(t.V.size(), 0.5));
  strange.append({"someone else"}, set.colours.row(0));
  EXPECT_THROW(build_model(shapes, &strange, t), InvalidInput);
}

TEST(BuildModel, RefusesSetsThatDoNotFit) {
  const MultiresTemplate t = grid_template(5);
  Random random(9);
  RegisteredSet set = random_set(random, t, 3, 2);
  EXPECT_THROW(build_model(RegisteredSet{}, t), InvalidInput);
  EXPECT_THROW(build_model(set, grid_template(6)), InvalidInput);
  set.shapes(1, 1) = std::nan("");
  EXPECT_THROW(build_model(set, t), InvalidInput);
}

}  // namespace
}  // namespace facewright
