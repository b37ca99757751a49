// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/denoise_quadric.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace facewright {

LocalQuadric::LocalQuadric(const Eigen::Vector3d& origin, const Eigen::Vector3d& normal, double unit)
    : origin_(origin),
      normal_(normal),
      t1_(normal.unitOrthogonal()),
      t2_(normal.cross(t1_)),
      unit_(unit),
      per_unit_(1 / unit) {}

LocalQuadric::Value LocalQuadric::at_origin() const {
  Value value;
  if (count_ < 8) return value;
  // Normal equations in the order u, v, u^2, uv, v^2, 1: the constant comes last, so that forward substitution alone
  // gives it, and the last pivot its variance.
  static constexpr int kIndex[6][6] = {{3, 0, 0, 0, 0, 0},   {4, 5, 0, 0, 0, 0},    {6, 7, 10, 0, 0, 0},
                                       {7, 8, 11, 12, 0, 0}, {8, 9, 12, 13, 14, 0}, {1, 2, 3, 4, 5, 0}};
  static constexpr int kRight[6] = {1, 2, 3, 4, 5, 0};
  double L[6][6], inverse[6], z[6], trace = 0;
  for (const int k : {3, 5, 10, 12, 14, 0}) trace += moments_[static_cast<size_t>(k)];
  for (int r = 0; r < 6; ++r) {
    z[r] = right_[static_cast<size_t>(kRight[r])];
    for (int c = 0; c <= r; ++c) {
      double sum = moments_[static_cast<size_t>(kIndex[r][c])] + (r == c ? 1e-9 * trace : 0);
      for (int k = 0; k < c; ++k) sum -= L[r][k] * L[c][k];
      if (r != c) {
        L[r][c] = sum * inverse[c];
      } else {
        if (!(sum > 0)) return value;
        inverse[r] = 1 / std::sqrt(sum);
      }
    }
    for (int k = 0; k < r; ++k) z[r] -= L[r][k] * z[k];
    z[r] *= inverse[r];
  }
  value.height = z[5] * inverse[5] * unit_;
  value.variance = inverse[5] * inverse[5];
  double explained = 0;
  for (const double x : z) explained += x * x;
  value.residual = std::max(0.0, square_ - explained) * unit_ * unit_;
  value.freedom = moments_[0] - 6;
  value.valid = std::isfinite(value.height);
  return value;
}

}  // namespace facewright
