// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/registered_set.h"

namespace facewright {

/// The mean of the rows of X (S x D). Throws InvalidInput for no samples, and for NaN or infinity, naming the sample.
Eigen::RowVectorXd mean_sample(const SampleMatrix& X, int threads = 0);

/// The S x S matrix of inner products of the rows after subtracting `mean` (D), in double precision. O(S^2 D / 2), and
/// the same bytes for any number of threads.
Eigen::MatrixXd gram_matrix(const SampleMatrix& X, const Eigen::RowVectorXd& mean, int threads = 0);

/// From inner products about any origin to those about the mean of the samples: H G H with H = I - 11'/S. So samples
/// can be added to or taken from a set without touching the products of the others.
Eigen::MatrixXd centred_gram(Eigen::MatrixXd G);

/// Rows and columns `kept` of G: the Gram matrix of a subset.
Eigen::MatrixXd gram_of(const Eigen::MatrixXd& G, const std::vector<int>& kept);

}  // namespace facewright
