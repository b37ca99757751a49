// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

#include "libmodel/core/similarity.h"
#include "libmodel/fitting/fit_landmarks.h"
#include "libmodel/fitting/fit_shape.h"

namespace facewright {

/// What points in space say about a face: target k belongs to row k of the shape model; its error has the standard
/// deviation 1 / sqrt(across) along `normals` and 1 / sqrt(along) in the plane across them. Equal weights: a point;
/// along = 0: a plane.
struct PointTargets {
  Vertices positions;             ///< (K x 3) mm, the scan's frame
  Vertices normals;               ///< (K x 3) unit length, the scan's frame; may be empty if across == along
  Eigen::VectorXd across, along;  ///< (K) mm^-2, >= 0
};

/// Pose and coefficients of a face in space.
struct PointFit {
  Similarity scan_from_model;
  Eigen::VectorXd coefficients;
};
/// One Gauss-Newton step of pose and shape together on sum of weighted squared distances + lambda |c|^2. Exact in the
/// coefficients, first order in the pose. `covariance` (M x M), if not null, becomes the posterior's of the
/// coefficients, the pose unknown. O(K M^2). Throws SolverError if the targets leave the pose undetermined.
PointFit step_to_points(const PointFit& from, const LandmarkShapeModel& model, const PointTargets& targets,
                        double lambda, Scaling scaling, Eigen::MatrixXd* covariance = nullptr);

struct FitPointsOptions {
  double lambda = 1;                 ///< weight of the prior; 1 = calibrated
  double sigma_mm = 1;               ///< standard deviation of a landmark without one of its own, mm
  Scaling scaling = Scaling::fixed;  ///< free: the points' unit or the head's size is unknown
  int iterations = 50;               ///< rounds at most, >= 1
  double tolerance = 1e-4;           ///< stop when no coefficient moves more, standard deviations
  int modes = -1;                    ///< shape modes to use, -1 = all
  bool expression = true;            ///< use the model's expression modes if it has any
};

struct PointResidual {
  std::string name;
  int vertex = -1;
  Eigen::Vector3d measured, fitted;  ///< mm, the points' frame
};
struct FitPointsSummary {
  FitStop stop = FitStop::not_run;
  int iterations = 0;
  double last_change = 0;  ///< largest change of a coefficient in the last round, standard deviations
  double rms_mm = 0;
  std::vector<PointResidual> residuals;
  std::vector<std::string> unknown;  ///< landmarks the model does not have
  FitPointsOptions options;
};
struct FitPointsResult {
  Similarity scan_from_model;                                   ///< rigid unless scaling is free
  Eigen::VectorXd shape_coefficients, expression_coefficients;  ///< standard deviations
  Eigen::VectorXd coefficient_stddevs;  ///< posterior, of shape and expression, the pose unknown
  FitPointsSummary summary;
};

/// Fits pose and shape to 3D landmarks: maximum of the posterior with each landmark's own variance (its `stddev`, else
/// sigma_mm). Moves with the landmarks. Throws InvalidInput for fewer than 3 known landmarks, or landmarks on a line.
FitPointsResult fit_points(const MorphableModel& model, const Landmarks& landmarks,
                           const FitPointsOptions& options = {}, const LandmarkMapper& mapper = {});

}  // namespace facewright
