// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/normal_equations.h"

#include <gtest/gtest.h>

#include "libmodel/core/random.h"

namespace facewright {
namespace {

WhitenedRows random_rows(Eigen::Index columns) {
  Random random(static_cast<std::uint64_t>(columns));
  WhitenedRows rows;
  rows.columns = columns;
  rows.count = 2 * columns + 3;
  rows.rows.setZero(rows.count, (columns + 7) / 8 * 8);
  for (Eigen::Index i = 0; i < rows.count; ++i)
    for (Eigen::Index j = 0; j < columns; ++j) rows.rows(i, j) = random.normal();
  return rows;
}

TEST(NormalEquations, GramIsTheProductAndItsInverseAndSolutionHoldForAnyNumberOfColumns) {
  for (const Eigen::Index n : {1, 2, 7, 8, 9, 63, 64, 70, 71, 130}) {
    const WhitenedRows rows = random_rows(n);
    const Eigen::MatrixXd expected = rows.used().transpose() * rows.used();
    Eigen::MatrixXd G;
    gram(G, rows);
    const Eigen::MatrixXd error = (G - expected).triangularView<Eigen::Lower>();
    EXPECT_LT(error.norm(), 1e-13 * expected.norm());
    PositiveDefiniteSolver solver;
    ASSERT_TRUE(solver.compute(G));
    EXPECT_LT((solver.inverse() * expected - Eigen::MatrixXd::Identity(n, n)).norm(), 1e-10);
    const Eigen::VectorXd g = Eigen::VectorXd::LinSpaced(n, -1, 2);
    EXPECT_LT((expected * solver.solve(g) - g).norm(), 1e-10);
  }
}

TEST(NormalEquations, ASingularMatrixIsRefused) {
  WhitenedRows rows = random_rows(20);
  rows.rows.col(13) = rows.rows.col(4);
  Eigen::MatrixXd G;
  gram(G, rows);
  EXPECT_FALSE(PositiveDefiniteSolver().compute(G));
}

}  // namespace
}  // namespace facewright
