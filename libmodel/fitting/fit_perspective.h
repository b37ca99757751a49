// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "libmodel/fitting/fit_landmarks.h"
#include "libmodel/fitting/perspective_camera.h"

namespace facewright {

struct PerspectiveFitOptions {
  FitOptions fit;             ///< its `camera` is not used; sigma_mm counts at the face's mean depth
  PerspectiveOptions camera;  ///< focal length or its prior, principal point
};

struct PerspectiveFitSummary {
  FitStop stop = FitStop::not_run;
  int iterations = 0;
  double last_change = 0;  ///< largest change of a coefficient in the last round, standard deviations
  double rms_px = 0;       ///< over the landmarks that fix a point
  double rms_percent = 0;  ///< the same in percent of the outer eye distance in the image; 0 if that is unknown
  double outer_eye_distance_px = 0;  ///< between landmarks 37 and 46; 0 if either is missing
  double sigma_px = 0;               ///< used for landmarks without a deviation of their own
  double distance_mm = 0;            ///< mean depth of the landmarks
  double focal_spread = 0;           ///< standard deviation of log(focal length), shape free; 0 if it was given
  bool focal_determined = true;      ///< the landmarks tell the focal length better than its prior does
  std::vector<std::string> unknown;  ///< landmarks that the model does not have
  std::vector<LandmarkResidual> residuals;
  PerspectiveFitOptions options;
};
struct PerspectiveFitResult {
  PerspectiveCamera camera;
  HeadPose pose;                                                ///< of the camera's rotation, radians
  Eigen::VectorXd shape_coefficients, expression_coefficients;  ///< standard deviations
  std::map<std::string, double> blendshape_weights;             ///< by name, within their bounds
  Eigen::VectorXd coefficient_spread;  ///< posterior standard deviation of all coefficients, the camera free
  PerspectiveFitSummary summary;
};

/// As fit_landmarks, under a perspective camera of known or unknown focal length: the camera is linearised at each
/// landmark, so that each has an affine camera of its own, and follows the shape to first order. Matters where the
/// face's depth is more than about a tenth of its distance: a face at 500 mm seen as if from afar is too narrow.
/// Shape and expression are solved
/// together, blendshapes within their bounds. JawMode::contour is refused. Throws InvalidInput as fit_landmarks and
/// estimate_perspective_camera do.
PerspectiveFitResult fit_landmarks_perspective(const MorphableModel& model, const ImageLandmarks& landmarks,
                                               const PerspectiveFitOptions& options, const LandmarkMapper& mapper = {});

/// The fitted face with its expression, colours and texture coordinates, at a level of the model.
Mesh fitted_mesh(const MorphableModel& model, const PerspectiveFitResult& fit, int level = -1);

}  // namespace facewright
