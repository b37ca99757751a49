// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/camera.h"
#include "libmodel/fitting/affine_camera.h"
#include "libmodel/fitting/observations.h"

namespace facewright {

struct PerspectiveOptions {
  double focal_px = 0;                                  ///< pixels; 0 = unknown: found, with the prior below
  Eigen::Vector2d principal = Eigen::Vector2d::Zero();  ///< pixels; usually the image's centre
  /// Of an unknown focal length, pixels; 1.2 times the longer side of the image suits photographs [schoenberger2016].
  double prior_focal_px = 0;
  double prior_focal_spread = 0.5;  ///< standard deviation of its logarithm; > 0
  int iterations = 50;              ///< Levenberg-Marquardt steps at most
  double tolerance = 1e-11;         ///< stop below this step: radians, and relative scale
};

struct PerspectiveSummary {
  int iterations = 0;
  bool converged = false;
  double rms_px = 0;  ///< over the points of non-zero weight
  /// Standard deviation of log(focal length) given the points' weights and the prior; 0 if it was given.
  double focal_spread = 0;
  /// The points tell the focal length better than the prior does (half its spread at most). If false, the focal length
  /// and with it the distance are little more than the prior; the shape of the projection is good all the same.
  bool focal_determined = true;
};
struct PerspectiveResult {
  PerspectiveCamera camera;
  PerspectiveSummary summary;
};

/// The camera that sees `centre` where and as large as the orthographic one does: its depth is focal / scale, and its
/// rotation is turned by the direction in which it looks at the centre.
PerspectiveCamera perspective_from_orthographic(const OrthographicCamera& camera, double focal_px,
                                                const Eigen::Vector2d& principal, const Eigen::Vector3d& centre);

/// Minimises sum_k r_k^T W_k r_k, r_k = x_k - project(X_k), plus the focal length's prior, by Levenberg-Marquardt over
/// rotation, translation and, where it is unknown, focal length [hartley2004, section 7.2]; X (K x 3) mm, x (K x 2)
/// pixels, W (K). Throws InvalidInput for options that do not hold, SolverError if the weights leave the camera
/// undetermined or points come to lie behind it.
PerspectiveResult refine_perspective(const PerspectiveCamera& start, const Vertices& X, const Pixels& x,
                                     const std::vector<Information>& W, const PerspectiveOptions& options = {});

/// From nothing: Gold Standard affine camera, its scaled-orthographic neighbour, a depth from the focal length (or its
/// prior), then refine_perspective. K >= 4 points not in a plane, 5 if the focal length is unknown; W empty: each point
/// is known to one pixel. Throws as these do.
PerspectiveResult estimate_perspective_camera(const Vertices& X, const Pixels& x, const PerspectiveOptions& options,
                                              const std::vector<Information>& W = {});

/// Derivative of the K projected points: (2K x 7) by rotation vector about `centre` (camera axes), shift in x and y
/// (pixels at the centre), log scale at the centre, and log focal length at that scale (the last: how much
/// perspective). Without the last column where the focal length is given.
Eigen::MatrixXd pixel_derivative(const PerspectiveCamera& camera, const Vertices& X, const Eigen::Vector3d& centre,
                                 bool with_focal);

}  // namespace facewright
