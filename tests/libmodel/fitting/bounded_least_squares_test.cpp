// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/bounded_least_squares.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"

namespace facewright {
namespace {

Eigen::MatrixXd random_matrix(Random& random, int rows, int columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

TEST(BoundedLeastSquares, SatisfiesTheOptimalityConditionsOnRandomProblems) {
  Random random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const int n = 1 + trial % 12;
    const Eigen::MatrixXd A = random_matrix(random, 20, n);
    const Eigen::VectorXd b = 2 * random_matrix(random, 20, 1);
    const Eigen::VectorXd lower = Eigen::VectorXd::Zero(n), upper = Eigen::VectorXd::Constant(n, 0.3);
    const BoundedLeastSquaresResult result = bounded_least_squares(A, b, lower, upper, 0.1);
    ASSERT_TRUE(result.summary.converged);
    const Eigen::VectorXd descent = A.transpose() * (b - A * result.x) - 0.1 * result.x;
    for (int i = 0; i < n; ++i) {
      EXPECT_GE(result.x[i], 0);
      EXPECT_LE(result.x[i], 0.3);
      EXPECT_TRUE(result.x[i] == 0 || descent[i] > -1e-9);
      EXPECT_TRUE(result.x[i] == 0.3 || descent[i] < 1e-9);
    }
  }
}

TEST(BoundedLeastSquares, WithoutBoundsIsLeastSquares) {
  Random random(2);
  const Eigen::MatrixXd A = random_matrix(random, 30, 7);
  const Eigen::VectorXd b = random_matrix(random, 30, 1);
  const Eigen::VectorXd far = Eigen::VectorXd::Constant(7, std::numeric_limits<double>::infinity());
  EXPECT_LT((bounded_least_squares(A, b, -far, far).x - A.colPivHouseholderQr().solve(b)).norm(), 1e-10);
}

TEST(BoundedLeastSquares, RecoversPlantedWeightsSomeOfThemAtTheirBounds) {
  Random random(3);
  const Eigen::MatrixXd A = random_matrix(random, 40, 5);
  const Eigen::VectorXd truth = (Eigen::VectorXd(5) << 0, 1, 0.4, 0, 0.7).finished();
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(5), one = Eigen::VectorXd::Ones(5);
  EXPECT_LT((bounded_least_squares(A, A * truth, zero, one).x - truth).norm(), 1e-9);
}

TEST(BoundedLeastSquares, StaysFiniteAndWithinBoundsWhereColumnsRepeat) {
  Random random(4);
  Eigen::MatrixXd A = random_matrix(random, 10, 6);
  A.rightCols(3) = A.leftCols(3);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(6), one = Eigen::VectorXd::Ones(6);
  const Eigen::VectorXd x = bounded_least_squares(A, random_matrix(random, 10, 1), zero, one).x;
  EXPECT_TRUE(x.allFinite());
  EXPECT_GE(x.minCoeff(), 0);
  EXPECT_LE(x.maxCoeff(), 1);
}

TEST(BoundedLeastSquares, RefusesBoundsThatCrossAndSizesThatDiffer) {
  const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(3, 3);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(3), one = Eigen::VectorXd::Ones(3);
  EXPECT_THROW(bounded_least_squares(A, one, one, zero), InvalidInput);
  EXPECT_THROW(bounded_least_squares(A, Eigen::VectorXd::Ones(2), zero, one), InvalidInput);
  EXPECT_THROW(minimise_bounded(A, one, zero, Eigen::VectorXd::Ones(2)), InvalidInput);
}

}  // namespace
}  // namespace facewright
