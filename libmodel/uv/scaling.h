// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

// Private to this module.

struct ScalingResult {
  TexCoords points;                   ///< (N x 2)
  double third_eigenvalue_share = 0;  ///< lambda_3 / lambda_1
};

/// Landmark multidimensional scaling in the plane [desilva2004]: D (m x N) holds the distances of `landmarks` (m) to
/// all N points. With all points as landmarks this is classical scaling [torgerson1952].
ScalingResult landmark_scaling(const Eigen::MatrixXd& D, const std::vector<int>& landmarks);

}  // namespace facewright
