// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/point_grid.h"

#include <algorithm>
#include <cmath>

namespace facewright {
namespace {

std::uint64_t key(const std::array<std::int64_t, 3>& c) {
  constexpr std::int64_t kMiddle = 1 << 20, kMask = (1 << 21) - 1;
  std::uint64_t k = 0;
  for (const std::int64_t x : c) k = k << 21 | static_cast<std::uint64_t>((x + kMiddle) & kMask);
  return k;
}

}  // namespace

PointGrid::PointGrid(const Vertices& points, double cell) : points_(points), cell_(cell) {
  for (Eigen::Index i = 0; i < points.rows(); ++i) cells_[key(cell_of(points.row(i)))].push_back(static_cast<int>(i));
}

std::array<std::int64_t, 3> PointGrid::cell_of(const Eigen::Vector3d& x) const {
  constexpr double kFarthest = 1e15;  // cells; farther points are damage, and together
  std::array<std::int64_t, 3> c{};
  for (int k = 0; k < 3; ++k)
    c[static_cast<size_t>(k)] = static_cast<std::int64_t>(std::clamp(std::floor(x[k] / cell_), -kFarthest, kFarthest));
  return c;
}

std::vector<int> PointGrid::within(const Eigen::Vector3d& centre, double radius) const {
  std::vector<int> found;
  const auto low = cell_of(centre.array() - radius), high = cell_of(centre.array() + radius);
  for (std::int64_t x = low[0]; x <= high[0]; ++x)
    for (std::int64_t y = low[1]; y <= high[1]; ++y)
      for (std::int64_t z = low[2]; z <= high[2]; ++z) {
        const auto it = cells_.find(key({x, y, z}));
        if (it == cells_.end()) continue;
        for (const int j : it->second)
          if ((points_.row(j).transpose() - centre).squaredNorm() <= radius * radius) found.push_back(j);
      }
  return found;
}

}  // namespace facewright
