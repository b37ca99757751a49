// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/image.h"
#include "libmodel/core/multires_template.h"
#include "libmodel/surface/nearest.h"
#include "libregister/registration/register_scan.h"

namespace facewright {

/// Distances (N) of points to a surface, mm, positive on the side its normals point to. `nearest` (N) are the points'
/// nearest places on it.
Eigen::VectorXd signed_distances(const Vertices& points, const Mesh& surface, const std::vector<NearestPoint>& nearest);

struct ErrorPictureOptions {
  double range = 1;  ///< mm, > 0: distance at which the colours end
  int height = 360;  ///< pixels of a view, 100..4000; the picture is 2.55 times as wide and 1.15 times as high
  double side = 50;  ///< degrees the half profiles are turned, 0..90
};

/// How far a registered face lies from its denoised scan: half profile, front, half profile, in the reference's pose.
/// Blue lies inside the scan, red outside; grey hatched is what found no match of its own: strokes one way mirrored,
/// the other way interpolated, both ways free. Below, the colour bar and the figures. Throws InvalidInput for sizes
/// that do not fit. The bytes do not depend on anything else.
Image error_picture(const RegistrationResult& result, const MultiresTemplate& reference,
                    const ErrorPictureOptions& options = {});

}  // namespace facewright
