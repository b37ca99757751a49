// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/camera.h"
#include "libmodel/fitting/affine_camera.h"
#include "libmodel/fitting/observations.h"

namespace facewright {

/// The scaled-orthographic camera nearest to an affine one: scale = mean length of its rows, rotation = the nearest to
/// their directions. Throws InvalidInput if a row is zero or the rows are parallel.
OrthographicCamera nearest_orthographic(const AffineCamera& camera);

/// The linear estimate: nearest_orthographic of the affine camera of X (K x 3) mm, x (K x 2) pixels, K >= 4 and not in
/// a plane. refine_orthographic makes it the least squares camera. O(K).
OrthographicCamera estimate_orthographic_camera(const Vertices& X, const Pixels& x);

struct OrthographicOptions {
  int iterations = 20;       ///< Gauss-Newton steps at most
  double tolerance = 1e-12;  ///< stop below this step: radians, and relative scale
};
struct OrthographicSummary {
  int iterations = 0;
  bool converged = false;
  double rms_px = 0;  ///< over the observations of non-zero weight
};
struct OrthographicResult {
  OrthographicCamera camera;
  OrthographicSummary summary;
};

/// Minimises sum_k r_k^T W_k r_k over rotation, scale and shift by Gauss-Newton, r_k = x_k - project(X_k); X (K x 3)
/// mm, x (K x 2) pixels, W (K). Throws SolverError if the weights leave the camera undetermined.
OrthographicResult refine_orthographic(const OrthographicCamera& start, const Vertices& X, const Pixels& x,
                                       const std::vector<Information>& W, const OrthographicOptions& options = {});

/// Derivative of the K projected points by rotation vector (camera axes), log scale and shift: (2K x 6).
Eigen::MatrixXd pixel_derivative(const OrthographicCamera& camera, const Vertices& X);

}  // namespace facewright
