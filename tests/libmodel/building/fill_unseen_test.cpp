// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/fill_unseen.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "libmodel/core/errors.h"
#include "planted.h"

namespace facewright {
namespace {

using testing::grid_template;
using testing::planted_gaussian;

// Colours on a grid: a tone per face, two planted modes, and smooth fields that no mode can foretell.
struct PaintedGrid {
  MultiresTemplate t = grid_template(24);
  SampleMatrix truth, visibility;
};

PaintedGrid painted_grid(std::uint64_t seed, double field = 0.02) {
  PaintedGrid g;
  Random random(seed);
  const Eigen::Index N = g.t.V.rows(), S = 40;
  const Eigen::MatrixXd modes = 0.05 * testing::random_matrix(random, 2, 3 * N);
  g.truth.resize(S, 3 * N);
  g.visibility = SampleMatrix::Ones(S, N);
  for (Eigen::Index s = 0; s < S; ++s) {
    const Eigen::RowVectorXd a = testing::random_matrix(random, 1, 2);
    const Eigen::Vector2d wave = 0.05 * Eigen::Vector2d(random.normal(), random.normal());
    const double phase = random.uniform(0, 6), tone = 0.5 + 0.1 * random.normal();
    g.truth.row(s) = a * modes;
    g.truth.row(s).array() += tone;
    for (Eigen::Index v = 0; v < N; ++v)
      g.truth.row(s).segment<3>(3 * v).array() += field * std::cos(g.t.V.row(v).head<2>().dot(wave) + phase);
    for (int y = 0, x0 = random.index(18), y0 = random.index(18); y < 7; ++y)  // a patch of 7 x 7
      for (int x = 0; x < 7; ++x) g.visibility(s, 24 * std::min(y0 + y, 23) + std::min(x0 + x, 23)) = 0;
  }
  return g;
}

SampleMatrix blotted(const PaintedGrid& g, double value) {
  SampleMatrix values = g.truth;
  for (Eigen::Index s = 0; s < values.rows(); ++s)
    for (Eigen::Index v = 0; v < g.visibility.cols(); ++v)
      if (g.visibility(s, v) < 1) values.row(s).segment<3>(3 * v).setConstant(value);
  return values;
}

double hidden_rms(const PaintedGrid& g, const SampleMatrix& filled) {
  return (filled - g.truth).norm() / std::sqrt(3 * (1 - g.visibility.array()).sum());
}

SampleMatrix mean_filled(const PaintedGrid& g) {
  SampleMatrix filled = g.truth;
  for (Eigen::Index v = 0; v < g.visibility.cols(); ++v) {
    const Eigen::RowVector3d mean =
        g.visibility.col(v).transpose() * g.truth.middleCols<3>(3 * v) / g.visibility.col(v).sum();
    for (Eigen::Index s = 0; s < filled.rows(); ++s)
      if (g.visibility(s, v) < 1) filled.row(s).segment<3>(3 * v) = mean;
  }
  return filled;
}

TEST(FillUnseen, IsFarNearerThanTheMeanAndNeighboursBringItNearer) {
  const PaintedGrid g = painted_grid(1);
  FillUnseenOptions alone;
  alone.correlation_length = 0;
  const Faces& F = g.t.levels.back().F;
  const FillUnseenResult modes = fill_unseen(blotted(g, 9), g.visibility, g.t.V, F, alone);
  const FillUnseenResult both = fill_unseen(blotted(g, 9), g.visibility, g.t.V, F);
  EXPECT_LT(3 * hidden_rms(g, modes.values), hidden_rms(g, mean_filled(g)));
  EXPECT_LT(1.25 * hidden_rms(g, both.values), hidden_rms(g, modes.values)) << "patches four lengths wide";
  EXPECT_GT(both.summary.edge_correlation, 0.8);
}

TEST(FillUnseen, ForetellsItsOwnError) {
  const PaintedGrid g = painted_grid(2);
  FillUnseenOptions alone;
  alone.correlation_length = 0;
  const FillUnseenResult filled = fill_unseen(blotted(g, 9), g.visibility, g.t.V, g.t.levels.back().F, alone);
  EXPECT_NEAR(filled.summary.held_out.filled / hidden_rms(g, filled.values), 1, 0.3);
  EXPECT_NEAR(filled.summary.held_out.mean / hidden_rms(g, mean_filled(g)), 1, 0.3);
}

TEST(FillUnseen, WhatStoodInTheUnseenDoesNotMatter) {
  const PaintedGrid g = painted_grid(3);
  const Faces& F = g.t.levels.back().F;
  const SampleMatrix a = fill_unseen(blotted(g, 0), g.visibility, g.t.V, F).values;
  const SampleMatrix b = fill_unseen(blotted(g, 1e6), g.visibility, g.t.V, F).values;
  EXPECT_EQ(a, b);
}

TEST(FillUnseen, IsTheSameForAnyNumberOfThreads) {
  const PaintedGrid g = painted_grid(4);
  FillUnseenOptions one, three;
  one.threads = 1;
  three.threads = 3;
  const Faces& F = g.t.levels.back().F;
  EXPECT_EQ(fill_unseen(blotted(g, 9), g.visibility, g.t.V, F, one).values,
            fill_unseen(blotted(g, 9), g.visibility, g.t.V, F, three).values);
}

TEST(FillUnseen, FollowsTheUnitsOfTheValues) {  // equivariance: gains and offsets of all values
  const PaintedGrid g = painted_grid(5);
  FillUnseenOptions options;
  options.modes = 3;
  options.tolerance = 1e-12;
  options.max_iterations = 10;
  const Faces& F = g.t.levels.back().F;
  const SampleMatrix plain = fill_unseen(blotted(g, 0), g.visibility, g.t.V, F, options).values;
  const SampleMatrix moved =
      fill_unseen((4 * blotted(g, 0).array() + 7).matrix(), g.visibility, g.t.V, F, options).values;
  EXPECT_LT((moved - (4 * plain.array() + 7).matrix()).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(FillUnseen, BadlySeenValuesLieBetweenWhatWasSeenAndWhatIsExpected) {
  PaintedGrid g = painted_grid(6);
  const Faces& F = g.t.levels.back().F;
  SampleMatrix values = blotted(g, 0.9);
  const SampleMatrix expected = fill_unseen(values, g.visibility, g.t.V, F).values;
  SampleMatrix half = g.visibility;
  for (double& w : half.reshaped()) w = w < 1 ? 1e-6 : 1;  // seen very badly: nearly the same
  EXPECT_LT((fill_unseen(values, half, g.t.V, F).values - expected).cwiseAbs().maxCoeff(), 0.02);
  for (double& w : half.reshaped()) w = w < 1 ? 0.999 : 1;
  EXPECT_LT((fill_unseen(values, half, g.t.V, F).values - values).cwiseAbs().maxCoeff(), 0.002);
}

TEST(FillUnseen, NoiseIsThatWhichWasPlanted) {
  Random random(7);
  auto planted = planted_gaussian(random, 60, 600, 3);
  planted.samples += 0.5 * testing::random_matrix(random, 60, 600);
  SampleMatrix visibility = SampleMatrix::Ones(60, 200);
  for (double& w : visibility.reshaped()) w = random.uniform() < 0.1 ? 0 : 1;
  const FillUnseenResult filled = fill_unseen(planted.samples, visibility);
  EXPECT_EQ(filled.summary.modes, 3);
  EXPECT_NEAR(filled.summary.noise, 0.5, 0.03);
  EXPECT_GT(filled.summary.uncertain_share, 0);
  EXPECT_LT(filled.summary.uncertain_share, 0.01);
}

TEST(FillUnseen, VerticesNobodySawComeFromTheirNeighbours) {
  PaintedGrid g = painted_grid(8, 0);
  for (const int v : {200, 201, 224, 225}) {
    g.visibility.col(v).setZero();
    g.truth.middleCols<3>(3 * v).setConstant(0.5);
  }
  const FillUnseenResult filled = fill_unseen(blotted(g, 9), g.visibility, g.t.V, g.t.levels.back().F);
  EXPECT_EQ(filled.summary.never_seen, 4);
  EXPECT_TRUE(filled.values.allFinite());
  EXPECT_LT(filled.values.middleCols<6>(600).maxCoeff(), 1.2);
  EXPECT_GT(filled.values.middleCols<6>(600).minCoeff(), -0.2);
}

// Twelve faces of one tone each on a grid, of which nearly every vertex was seen; of the block of 8 x 8 in a corner
// only the lightest two show a third, and the rest nobody.
PaintedGrid block_that_only_light_faces_show() {
  PaintedGrid g;
  g.t = grid_template(24);
  Random random(12);
  const Eigen::Index N = g.t.V.rows(), S = 12;
  g.truth = 0.01 * testing::random_matrix(random, S, 3 * N);
  g.visibility = SampleMatrix::Ones(S, N);
  for (Eigen::Index s = 0; s < S; ++s) {
    const double tone = 0.1 + 0.05 * static_cast<double>(s);
    for (Eigen::Index v = 0; v < N; ++v) {
      g.truth.row(s).segment<3>(3 * v) += Eigen::RowVector3d(tone, 0.6 * tone, 0.4 * tone);
      if (v / 24 < 8 && v % 24 < 8) g.visibility(s, v) = s >= S - 2 && random.uniform() < 0.33 ? 1 : 0;
    }
  }
  return g;
}

TEST(FillUnseen, WhatOnlyLightFacesShowStaysDarkOnTheDark) {
  const PaintedGrid g = block_that_only_light_faces_show();
  const SampleMatrix filled = fill_unseen(blotted(g, 0), g.visibility, g.t.V, g.t.levels.back().F).values;
  for (Eigen::Index s = 0; s < 12; ++s) {
    double sum = 0, truth = 0;
    for (Eigen::Index v = 0; v < g.visibility.cols(); ++v)
      if (v / 24 < 8 && v % 24 < 8) sum += filled(s, 3 * v), truth += g.truth(s, 3 * v);
    EXPECT_NEAR(sum / truth, 1, 0.05) << s;
  }
}

TEST(FillUnseen, FewSamplesAreNoReasonToFail) {
  const PaintedGrid g = painted_grid(9);
  for (const int n : {1, 2, 3, 5}) {
    const FillUnseenResult filled =
        fill_unseen(blotted(g, 9).topRows(n), g.visibility.topRows(n), g.t.V, g.t.levels.back().F);
    EXPECT_TRUE(filled.values.allFinite()) << n;
    EXPECT_LT(filled.values.maxCoeff(), 2) << n;
  }
}

TEST(FillUnseen, SharesAreToldPerSample) {
  const PaintedGrid g = painted_grid(10);
  const FillUnseenSummary s = fill_unseen(blotted(g, 9), g.visibility, g.t.V, g.t.levels.back().F).summary;
  ASSERT_EQ(s.sample_shares.size(), 40U);
  for (int i = 0; i < 40; ++i) EXPECT_NEAR(s.sample_shares[i], 1 - g.visibility.row(i).mean(), 1e-12);
  EXPECT_NEAR(s.filled_share, 1 - g.visibility.mean(), 1e-12);
}

TEST(FillUnseen, NumbersThatAreNoneMatterOnlyWhereTheyWereSeen) {
  PaintedGrid g = painted_grid(13);
  const double nan = std::nan("");
  const Faces& F = g.t.levels.back().F;
  for (const int v : {200, 201}) g.visibility.col(v).setZero();
  const SampleMatrix filled = fill_unseen(blotted(g, 9), g.visibility, g.t.V, F).values;
  EXPECT_EQ(fill_unseen(blotted(g, nan), g.visibility, g.t.V, F).values, filled);
  SampleMatrix values = blotted(g, 9);
  g.visibility(3, 7) = 1;
  values(3, 22) = nan;
  EXPECT_THAT(
      [&] { fill_unseen(values, g.visibility, g.t.V, F); },
      ::testing::ThrowsMessage<InvalidInput>(::testing::HasSubstr("sample 3 holds NaN or infinity at vertex 7")));
  g.visibility(0, 0) = nan;
  EXPECT_THROW(fill_unseen(g.truth, g.visibility), InvalidInput);
}

TEST(UnseenFill, CompletesWhatItLearntFromAsTheWholeAndStrangersNearlyAsWell) {
  const PaintedGrid g = painted_grid(12);
  const Faces& F = g.t.levels.back().F;
  const SampleMatrix given = blotted(g, 9);
  const UnseenFill all(given, g.visibility, g.t.V, F), half(given.topRows(20), g.visibility.topRows(20), g.t.V, F);
  SampleMatrix by_all = given, by_half = given;
  for (Eigen::Index s = 0; s < given.rows(); ++s) {
    Eigen::RowVectorXd row = given.row(s);
    EXPECT_GT(all.complete(row, g.visibility.row(s)), 0);
    by_all.row(s) = row;
    row = given.row(s);
    half.complete(row, g.visibility.row(s));
    by_half.row(s) = row;
  }
  EXPECT_EQ(by_all, fill_unseen(given, g.visibility, g.t.V, F).values);
  PaintedGrid strangers = g;
  strangers.truth = g.truth.bottomRows(20), strangers.visibility = g.visibility.bottomRows(20);
  EXPECT_LT(2 * hidden_rms(strangers, by_half.bottomRows(20)), hidden_rms(strangers, mean_filled(strangers)));
  Eigen::RowVectorXd short_row = given.row(0).head(30);
  EXPECT_THROW(half.complete(short_row, g.visibility.row(0)), InvalidInput);
}

TEST(FillUnseen, RefusesWhatDoesNotFit) {
  const PaintedGrid g = painted_grid(11);
  EXPECT_THROW(fill_unseen(g.truth, g.visibility.leftCols(5)), InvalidInput);
  EXPECT_THROW(fill_unseen(g.truth, 2 * g.visibility), InvalidInput);
  EXPECT_THROW(fill_unseen(g.truth, g.visibility, g.t.V.topRows(3), Faces()), InvalidInput);
  FillUnseenOptions options;
  options.correlation_length = -1;
  EXPECT_THROW(fill_unseen(g.truth, g.visibility, options), InvalidInput);
}

}  // namespace
}  // namespace facewright
