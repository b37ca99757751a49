// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/camera.h"
#include "libmodel/fitting/observations.h"

namespace facewright {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// The part of a model that landmarks see: mean and scaled basis at their vertices.
struct LandmarkShapeModel {
  Eigen::VectorXd mean;  ///< (3K)
  RowMatrix basis;       ///< (3K x M), columns times their standard deviation

  Vertices points(const Eigen::VectorXd& coefficients) const;  ///< (K x 3)
};
/// Rows of `shape` (and `expression`, behind it, if given) at the observed vertices; the first `modes` shape modes.
LandmarkShapeModel landmark_shape_model(const std::vector<Observation>& seen, const PcaModel& shape, int modes,
                                        const PcaModel* expression = nullptr);

struct ShapeSummary {
  int rows = 0;            ///< equations: two per point, one per point that slides along a line
  bool determined = true;  ///< the solution is unique: always with a prior, else if the landmarks fix all modes
};
struct ShapeResult {
  Eigen::VectorXd coefficients;  ///< standard deviations of the modes
  /// (M x M) of the posterior, under the landmarks' variances and the prior; empty unless asked for, infinite on the
  /// diagonal where the solution is not determined.
  Eigen::MatrixXd covariance;
  ShapeSummary summary;

  Eigen::VectorXd stddevs() const;
};

/// Maximum a posteriori coefficients under a fixed camera, in closed form:
///   argmin_c sum_k r_k^T W_k r_k + lambda |c|^2,  r_k = x_k - (A (mean_k + basis_k c) + b).
/// With W the landmarks' inverse covariances, lambda = 1 is the calibrated posterior [aldrian2013]; lambda = 0 is least
/// squares, of least norm where it is not unique. Residuals that the columns of `nuisance` (2K x P, derivative of the
/// pixels by the camera's parameters) explain do not count: the shape that is best when the camera may follow to first
/// order (variable projection, [golub2003]). O(K M^2). Throws InvalidInput for lambda < 0.
ShapeResult fit_shape_posterior(const LandmarkShapeModel& model, const std::vector<Observation>& seen,
                                const AffineCamera& camera, const std::vector<Information>& W, double lambda,
                                const Eigen::MatrixXd& nuisance = {}, bool with_covariance = true);

/// Its coefficients alone.
Eigen::VectorXd fit_shape(const LandmarkShapeModel& model, const std::vector<Observation>& seen,
                          const AffineCamera& camera, const std::vector<Information>& W, double lambda,
                          const Eigen::MatrixXd& nuisance = {});

}  // namespace facewright
