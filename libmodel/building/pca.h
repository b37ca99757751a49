// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/registered_set.h"
#include "libmodel/model/pca_model.h"

namespace facewright {

struct PcaOptions {
  double variance_share = 0.99;  ///< (0, 1]; keep the fewest modes that explain this share [huber2016]
  int max_modes = -1;            ///< -1 = as many as the share needs
  int dense_limit = 2000;        ///< scans up to which the whole Gram matrix is diagonalised; above, Lanczos
  int threads = 0;               ///< 0 = all
};

struct PcaSummary {
  int scan_count = 0;
  int rank = 0;               ///< modes with variance; at most scan_count - 1. A lower bound above dense_limit
  int mode_count = 0;         ///< modes kept
  double total_variance = 0;  ///< trace of the covariance
  double kept_variance = 0;   ///< sum of the kept variances
  PcaOptions options;
};

struct PcaResult {
  PcaModel model;
  Eigen::MatrixXd scores;  ///< (S x K) coefficients of the samples, in standard deviations
  PcaSummary summary;
};

/// Principal component analysis of the rows of X (S x D), covariance with 1/(S - 1), by the S x S Gram matrix in double
/// precision (Sirovich's method of snapshots). The largest entry of every basis vector is positive, ties going to the
/// lowest index. Modes below 1e-12 of the first, or below rounding of the data, do not exist: duplicates and single
/// samples give fewer modes, never NaN. Throws InvalidInput for no rows, NaN, or options out of range.
/// O(S^2 D + S^3), memory S^2 besides X and the basis; the same bytes for any number of threads.
PcaResult fit_pca(const SampleMatrix& X, const PcaOptions& options = {});

/// The S x S matrix of inner products of the rows after subtracting `mean` (D).
Eigen::MatrixXd gram_matrix(const SampleMatrix& X, const Eigen::RowVectorXd& mean, int threads = 0);

}  // namespace facewright
