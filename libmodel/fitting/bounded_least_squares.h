// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace facewright {

struct BoundedLeastSquaresSummary {
  int iterations = 0;      ///< linear systems solved
  bool converged = false;  ///< the optimality conditions hold; otherwise the iteration limit was met
};
struct BoundedLeastSquaresResult {
  Eigen::VectorXd x;           ///< (n), within the bounds
  std::vector<int> free = {};  ///< variables strictly between their bounds, ascending
  BoundedLeastSquaresSummary summary;
};

/// argmin 1/2 x^T H x - g^T x, lower <= x <= upper, by the active set method of non-negative least squares with a
/// second bound [lawson1974]: exact, no step size. H (n x n) symmetric positive (semi)definite, lower triangle read;
/// bounds may be infinite. A few solves of the free variables' size. Throws InvalidInput for lower > upper or sizes
/// that differ.
BoundedLeastSquaresResult minimise_bounded(const Eigen::MatrixXd& H, const Eigen::VectorXd& g,
                                           const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);

/// argmin |A x - b|^2 + ridge |x|^2, lower <= x <= upper, A (m x n).
BoundedLeastSquaresResult bounded_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                                                const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                                                double ridge = 0);

}  // namespace facewright
