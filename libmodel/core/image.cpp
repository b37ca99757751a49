// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/core/image.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace facewright {

double srgb_from_linear(double x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055; }
double linear_from_srgb(double x) { return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4); }

double linear_from_srgb8(std::uint8_t encoded) {
  static const auto table = [] {
    std::array<double, 256> t{};
    for (int i = 0; i < 256; ++i) t[i] = linear_from_srgb(i / 255.0);
    return t;
  }();
  return table[encoded];
}

std::uint8_t srgb8_from_linear(double linear) {
  return static_cast<std::uint8_t>(std::lround(255 * srgb_from_linear(std::clamp(linear, 0.0, 1.0))));
}

Eigen::Vector3d sample_linear(const Image& image, const Eigen::Vector2d& p) {
  const double x = std::clamp(p[0], 0.0, image.width - 1.0), y = std::clamp(p[1], 0.0, image.height - 1.0);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, image.width - 1), y1 = std::min(y0 + 1, image.height - 1);
  const double fx = x - x0, fy = y - y0;
  const auto at = [&](int i, int j) {
    const std::uint8_t* q = image.pixel(i, j);
    const int step = image.channels >= 3 ? 1 : 0;
    return Eigen::Vector3d(linear_from_srgb8(q[0]), linear_from_srgb8(q[step]), linear_from_srgb8(q[2 * step]));
  };
  return (1 - fy) * ((1 - fx) * at(x0, y0) + fx * at(x1, y0)) + fy * ((1 - fx) * at(x0, y1) + fx * at(x1, y1));
}

}  // namespace facewright
