// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

#include "libmodel/core/camera.h"
#include "libmodel/core/landmarks.h"
#include "libmodel/model/landmark_mapper.h"
#include "libmodel/model/morphable_model.h"

namespace facewright {

/// A landmark seen in the image, tied to a vertex of the model.
struct Observation {
  std::string name;
  int vertex = -1;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double sigma_px = 0;  ///< its standard deviation if the file gave one, else 0
  int jaw_place = 0;    ///< 1..17 along the jaw line (ibug 1..17, the subject's right ear to the left), else 0
};

/// The landmarks the model knows, in landmark order; finite ones only. Those on the jaw line are ibug's 1..17, or the
/// mapping's contour landmarks, which need no vertex of their own.
std::vector<Observation> observations(const ImageLandmarks& landmarks, const MorphableModel& model,
                                      const LandmarkMapper& mapper);

/// How an observation counts: residual^T W residual, W (2 x 2) the inverse of its covariance in pixels^-2; W may be
/// singular (a point that may slide along a line) or zero (ignored).
using Information = Eigen::Matrix2d;
/// It fixes both coordinates, not just the distance to a line.
inline bool determines_point(const Information& W) {
  return W.determinant() > 1e-9 * W.trace() * W.trace();  // rounding leaves about 1e-16 on a line
}

/// What landmarks on the jaw line may do: their definition follows the visible outline, not a point of the face.
enum class JawMode {
  exclude,  ///< not used, but for the chin (9)
  slide,    ///< only their distance to the model's jaw line counts; those behind the turned face are dropped
  fixed,    ///< points like all others (3D-projected landmarks)
  contour   ///< tied in every round to the visible outline of the posed face (fit_landmarks), free to slide along it
};

/// Weights of all observations at the current state: `projected` (K x 2) are the current model points, yaw in radians.
/// JawMode::contour leaves the jaw without weight: its matches give it.
struct ObservationNoise {
  double sigma_px = 1;    ///< standard deviation of a landmark without one of its own, pixels
  double jaw_factor = 2;  ///< jaw landmarks are that much less certain
  JawMode jaw = JawMode::slide;
  double largest_yaw = 0.2;  ///< radians; beyond it the far side's jaw line is hidden and dropped
};
std::vector<Information> informations(const std::vector<Observation>& seen,
                                      const Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>& projected,
                                      double yaw, const ObservationNoise& noise);

}  // namespace facewright
