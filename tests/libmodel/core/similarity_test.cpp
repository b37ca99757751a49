// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/core/similarity.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "libmodel/core/errors.h"
#include "tests/support/matchers.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

TEST(FitSimilarity, RecoversAPlantedSimilarity) {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Similarity planted = random_similarity(random);
    const Vertices A = random_points(random, 10, 50);
    const Similarity found = fit_similarity(A, planted.apply(A));
    EXPECT_NEAR(found.s, planted.s, 1e-12);
    EXPECT_THAT(found.R, MatrixNear(Eigen::MatrixXd(planted.R), 1e-12));
    EXPECT_THAT(found.t, MatrixNear(Eigen::MatrixXd(planted.t), 1e-9));
  }
}

TEST(FitSimilarity, GivesARotationForReflectedPoints) {
  Random random(2);
  const Vertices A = random_points(random, 12, 50);
  Vertices B = A;
  B.col(0) *= -1;
  EXPECT_THAT(fit_similarity(A, B).R, IsRotation(1e-12));
}

TEST(FitSimilarity, IgnoresPointsOfWeightZero) {
  Random random(3);
  const Similarity planted = random_similarity(random);
  const Vertices A = random_points(random, 8, 50);
  Vertices B = planted.apply(A);
  B.row(3).array() += 1000;
  Eigen::VectorXd w = Eigen::VectorXd::Ones(8);
  w[3] = 0;
  EXPECT_NEAR(fit_similarity(A, B, w).s, planted.s, 1e-12);
}

TEST(FitSimilarity, RefusesTooFewPointsAndPointsOnALine) {
  EXPECT_THROW(fit_similarity(Vertices::Zero(2, 3), Vertices::Zero(2, 3)), InvalidInput);
  Vertices line(4, 3);
  line << 0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3;
  EXPECT_THROW(fit_similarity(line, line), InvalidInput);
}

TEST(Similarity, InverseAndProductAgreeWithTheirMeaning) {
  Random random(4);
  const Similarity a = random_similarity(random), b = random_similarity(random);
  const Eigen::Vector3d x(1, 2, 3);
  EXPECT_THAT((a * b) * x, MatrixNear(Eigen::MatrixXd(a * (b * x)), 1e-10));
  EXPECT_THAT(a.inverse() * (a * x), MatrixNear(Eigen::MatrixXd(x), 1e-10));
}

}  // namespace
}  // namespace facewright
