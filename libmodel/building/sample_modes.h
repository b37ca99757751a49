// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/registered_set.h"

namespace facewright {

// Private to this module: PCA without leaving the space of the samples.

struct SampleModes {
  Eigen::VectorXd variances;  ///< (K) descending, covariance with 1/(n - 1)
  Eigen::MatrixXd weights;    ///< (n x K): mode k, of unit length, is sum_j weights(j, k) (x_j - mean)
  Eigen::MatrixXd scores;     ///< (n x K): coordinates of the samples, (x_j - mean) . mode k
};

/// PCA of the rows `rows` of a set with Gram matrix G (inner products about any common origin): recentred on their own
/// mean, diagonalised. `rounding`: variance below which a mode is rounding of the data. At most n - 1 modes; signs such
/// that scores are skewed to the right, which depends neither on the order of samples nor on their frame.
SampleModes sample_modes(const Eigen::MatrixXd& G, const std::vector<int>& rows, double rounding);

/// Variance that rounding of samples of this size can pretend.
double rounding_variance(const Eigen::RowVectorXd& mean);

Eigen::RowVectorXd mean_of_rows(const SampleMatrix& X, const std::vector<int>& rows);

}  // namespace facewright
