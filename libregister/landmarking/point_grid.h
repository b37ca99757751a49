// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// Points sorted into cubic cells: all points within a radius, in the order of their cells. Keeps a copy.
class PointGrid {
 public:
  PointGrid(const Vertices& points, double cell);
  std::vector<int> within(const Eigen::Vector3d& centre, double radius) const;

 private:
  std::array<std::int64_t, 3> cell_of(const Eigen::Vector3d& x) const;

  Vertices points_;
  double cell_;
  std::unordered_map<std::uint64_t, std::vector<int>> cells_;
};

}  // namespace facewright
