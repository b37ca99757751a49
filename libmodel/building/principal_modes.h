// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/building/eigen_pairs.h"
#include "libmodel/building/pca.h"

namespace facewright {

// Private to this module: the steps that PCA of samples in memory and on disk share.

/// Throws InvalidInput for options out of range.
void check_pca_options(const PcaOptions& options);

/// An empty result of n samples: the mean, no modes.
PcaResult pca_without_modes(const Eigen::RowVectorXd& mean, Eigen::Index n, const PcaOptions& options);

/// Eigenpairs of G = (inner products of the centred samples) / (n - 1), enough for the share of its trace.
EigenPairs gram_eigenpairs(const Eigen::MatrixXd& G, const PcaOptions& options, PcaSummary* summary);

/// Variances and scores of the modes to keep, into `result`. `total`: the variance of all. Returns (n x K) weights
/// whose combinations of the centred samples are the basis.
Eigen::MatrixXd choose_modes(const EigenPairs& pairs, double total, PcaResult* result);

/// A basis (D x K), orthonormal up to the rounding of a Gram matrix, made so to rounding by one Cholesky QR; then
/// signs.
void finish_basis(PcaResult* result, int threads);

}  // namespace facewright
