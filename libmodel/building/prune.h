// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace facewright {

struct PruneOptions {
  double quantile = 0.99;  ///< (0, 1); of chi-squared beyond which a sample is an outlier
  int modes = 50;          ///< >= 1; leading modes that are looked at [booth2016]
};

struct PrunedSample {
  int sample = 0;
  double squared_mahalanobis = 0;
  int mode = 0;      ///< where it lies farthest out, and
  double score = 0;  ///< how far, in standard deviations
};

struct PruneResult {
  std::vector<int> kept;
  std::vector<PrunedSample> removed;    ///< farthest first
  Eigen::VectorXd squared_mahalanobis;  ///< (S)
  double threshold = 0;
  int modes = 0;  ///< those used: at most S / 10, for scores of few samples are bounded and say nothing
  PruneOptions options;
};

/// Samples whose squared Mahalanobis distance from the mean over the first modes is beyond a quantile of chi-squared
/// with as many degrees of freedom: failed registrations, mostly [booth2016]. `scores` (S x K) in standard deviations,
/// as of fit_pca. Nobody is removed from fewer than 10 samples. Throws InvalidInput for options out of range.
PruneResult find_outliers(const Eigen::MatrixXd& scores, const PruneOptions& options = {});

/// The same from inner products about any origin (S x S), as of SampleStore::gram.
PruneResult find_outliers_by_gram(const Eigen::MatrixXd& G, const PruneOptions& options = {}, int threads = 0);

/// x with P(X <= x) = p of a chi-squared variable of so many degrees of freedom (> 0); 0 < p < 1.
double chi_squared_quantile(double p, double degrees);

struct HeldOutOptions {
  int folds = 0;       ///< 0 = one per sample; else sample i is in fold i mod folds
  int max_modes = 50;  ///< >= 0
  int threads = 0;     ///< 0 = all
};

/// (S x M+1): squared distance of every sample to its reconstruction by the first 0, 1, .. M modes of a model made
/// without its fold, M = max_modes or what every fold has. From inner products about any origin (S x S) alone: the
/// samples themselves are not touched. O(folds S^3), above 400 samples O(folds S^2 M).
Eigen::MatrixXd held_out_squared_errors(const Eigen::MatrixXd& G, const HeldOutOptions& options = {});

}  // namespace facewright
