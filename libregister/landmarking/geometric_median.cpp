// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/geometric_median.h"

#include <algorithm>

namespace facewright {

Eigen::Vector3d geometric_median(const std::vector<Eigen::Vector3d>& points) {
  constexpr double kNear = 1e-6;  // keeps the weight of a point finite that the iteration stands on
  Eigen::Vector3d median = Eigen::Vector3d::Zero();
  if (points.empty()) return median;
  for (const Eigen::Vector3d& p : points) median += p / static_cast<double>(points.size());
  for (int iteration = 0; iteration < 200; ++iteration) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weight = 0;
    for (const Eigen::Vector3d& p : points) {
      const double w = 1 / std::max(kNear, (p - median).norm());
      sum += w * p;
      weight += w;
    }
    const Eigen::Vector3d next = sum / weight;
    const double step = (next - median).norm();
    median = next;
    if (step < 1e-7) break;
  }
  return median;
}

}  // namespace facewright
