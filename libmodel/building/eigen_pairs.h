// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <functional>

namespace facewright {

// Private to this module.

struct EigenPairs {
  Eigen::VectorXd values;   ///< descending
  Eigen::MatrixXd vectors;  ///< one column each
  int iterations = 0;
  double residual = 0;  ///< largest |G q - l q| / l_1 of the wanted pairs, where the method leaves one
};

/// All eigenpairs of a symmetric matrix.
EigenPairs all_eigenpairs(const Eigen::MatrixXd& G);

/// At least so many leading eigenpairs of a positive semidefinite G that their values sum to `wanted` or reach the rank
/// (or the first `max_pairs`, if >= 0), by implicitly restarted Lanczos; by random
/// subspaces where that gets stuck in a dense part of the spectrum. All of them where they are not few.
EigenPairs lanczos_eigenpairs(const Eigen::MatrixXd& G, double wanted, int max_pairs, int threads);

/// The same by subspace iteration from random vectors, Rayleigh and Ritz at the end, for a G (n x n) that is only known
/// by its product with a block of vectors [halko2011]: at least `power_iterations`, and up to 10 while the residual of
/// the wanted pairs is above 1e-10. Returns no pairs when they would not be few (more than n / 2).
EigenPairs random_eigenpairs(const std::function<Eigen::MatrixXd(const Eigen::MatrixXd&)>& G, Eigen::Index n,
                             double wanted, int max_pairs, int power_iterations);

}  // namespace facewright
