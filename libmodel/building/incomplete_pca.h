// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

#include "libmodel/core/registered_set.h"

namespace facewright {

// Private to this module: probabilistic PCA of samples of which parts are known badly or not at all.

/// x = mean + factors a + noise, a ~ N(0, I); a value of weight w has noise of variance noise / w.
struct IncompletePca {
  Eigen::VectorXd mean;  ///< (3N)
  SampleMatrix factors;  ///< (3N x K)
  double noise = 0;      ///< variance of a value of weight 1
  int iterations = 0;
  bool converged = true;
  double last_change = 0;  ///< root mean square, of the values of weight 0

  Eigen::Index mode_count() const { return factors.cols(); }
};

/// What the seen part of a sample says about its scores.
struct ScorePosterior {
  Eigen::VectorXd mean;        ///< (K)
  Eigen::MatrixXd covariance;  ///< (K x K)
};

/// Finds the scores of one sample after another, for a model that stands; all it keeps is K x K. O(3N K) each, and
/// O(K^2) for every vertex of weight below 1.
class ScoreEstimator {
 public:
  explicit ScoreEstimator(const IncompletePca& model, int threads = 1);
  /// `row` (3N), `weights` (N) 0..1; values of weight 0 are not looked at.
  ScorePosterior operator()(const Eigen::Ref<const Eigen::RowVectorXd>& row,
                            const Eigen::Ref<const Eigen::RowVectorXd>& weights) const;

 private:
  const IncompletePca& model_;
  Eigen::MatrixXd information_;  // factors' factors
};

class ResidualField;

struct IncompletePcaOptions {
  int modes = 1;  ///< at most; fewer if the samples have fewer
  int max_iterations = 50;
  double tolerance = 1e-4;                 ///< of last_change and of the noise's standard deviation
  int threads = 0;                         ///< 0 = all
  const ResidualField* surface = nullptr;  ///< the samples' vertices, if they are known to be neighbours
};

/// Expectation-maximisation with the posterior covariance of the scores in both steps [roweis1998, tipping1999]: each
/// row of the factors and of the mean is a regression on the scores of those samples that saw it, weighted by how well,
/// with a Gaussian prior on the factors whose variance per mode is learnt, so that rows seen by few are not overfitted
/// [ilin2010]. On a surface, the prior of a vertex that few saw is what the better seen around it say, mean and
/// factors: who saw it is no fair sample of all. `weights` (S x N) 0..1. Rows that nobody saw get the mean of the given
/// values and no factors. O(S N (K + u K^2)) per iteration, u the share of weights below 1.
IncompletePca fit_incomplete_pca(const SampleMatrix& X, const SampleMatrix& weights,
                                 const IncompletePcaOptions& options);

}  // namespace facewright
