// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/sampling.h"

#include <algorithm>

namespace facewright {

Eigen::Vector4d sample_rgba(const Image& image, const Eigen::Vector2d& p) {
  if (image.channels != 4) {
    Eigen::Vector4d out;
    out << sample_linear(image, p), 1;
    return out;
  }
  const double x = std::clamp(p[0], 0.0, image.width - 1.0), y = std::clamp(p[1], 0.0, image.height - 1.0);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const double fx = x - x0, fy = y - y0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), plain = Eigen::Vector3d::Zero();
  double alpha = 0;
  for (int k = 0; k < 4; ++k) {
    const int i = std::min(x0 + k % 2, image.width - 1), j = std::min(y0 + k / 2, image.height - 1);
    const double weight = (k % 2 ? fx : 1 - fx) * (k / 2 ? fy : 1 - fy);
    const std::uint8_t* q = image.pixel(i, j);
    const Eigen::Vector3d c(linear_from_srgb8(q[0]), linear_from_srgb8(q[1]), linear_from_srgb8(q[2]));
    sum += weight * (q[3] / 255.0) * c;
    plain += weight * c;
    alpha += weight * (q[3] / 255.0);
  }
  Eigen::Vector4d out;
  out << (alpha > 0 ? Eigen::Vector3d(sum / alpha) : plain), alpha;
  return out;
}

}  // namespace facewright
