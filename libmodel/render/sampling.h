// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

#include "libmodel/core/image.h"

namespace facewright {

/// Pixel position of a texture coordinate: u right, v up, the centre of texel (i, j) at ((i + .5) / W, 1 - (j + .5) /
/// H).
inline Eigen::Vector2d texel_position(const Eigen::Vector2d& uv, int width, int height) {
  return {uv[0] * width - 0.5, (1 - uv[1]) * height - 0.5};
}
inline Eigen::Vector2d texture_coordinate(double x, double y, int width, int height) {
  return {(x + 0.5) / width, 1 - (y + 0.5) / height};
}

/// Bilinear sample: linear RGB and alpha, clamped to the image; colours count by their alpha, so that transparent
/// texels do not bleed in. Images without alpha give 1.
Eigen::Vector4d sample_rgba(const Image& image, const Eigen::Vector2d& p);

}  // namespace facewright
