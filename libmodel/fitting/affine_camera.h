// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

#include "libmodel/core/camera.h"
#include "libmodel/core/mesh.h"

namespace facewright {

/// Image points, (K x 2), pixels.
using Pixels = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;

struct AffineCameraSummary {
  int points = 0;
  double condition = 0;  ///< of the normalised points, 1 is best; flat point sets run to infinity
  double rms_px = 0;     ///< root mean square distance between measured and projected points
};
struct AffineCameraResult {
  AffineCamera camera;
  AffineCameraSummary summary;
};

/// The affine camera of least squared reprojection error: the Gold Standard algorithm, [hartley2004] algorithm 7.2.
/// X (K x 3) in mm, x (K x 2) in pixels, K >= 4 and not in a plane; otherwise InvalidInput. O(K).
AffineCameraResult estimate_affine_camera(const Vertices& X, const Pixels& x);

/// Derivative of the K projected points by the camera's eight entries: (2K x 8).
Eigen::MatrixXd pixel_derivative(const Vertices& X);

}  // namespace facewright
