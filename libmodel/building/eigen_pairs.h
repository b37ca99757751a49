// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

namespace facewright {

// Private to this module.

struct EigenPairs {
  Eigen::VectorXd values;   ///< descending
  Eigen::MatrixXd vectors;  ///< one column each
};

/// All eigenpairs of a symmetric matrix.
EigenPairs all_eigenpairs(const Eigen::MatrixXd& G);
/// The leading k < n, by implicitly restarted Lanczos. Throws SolverError if it does not converge.
EigenPairs leading_eigenpairs(const Eigen::MatrixXd& G, int k);

}  // namespace facewright
