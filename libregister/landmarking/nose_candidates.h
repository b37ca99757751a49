// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// A place that stands out of a surface like the tip of a nose.
struct Dome {
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();    ///< mm
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< outwards, unit length: the mean normal around it
  double prominence = 0;                            ///< mean depth of its surroundings below it over their distance
};

/// The most prominent domes of a surface at the scale `radius` (mm), the best first, at least 1.5 radii apart; borders
/// are left out. `normals` (N x 3) of the vertices. O(N * neighbours).
std::vector<Dome> find_domes(const Mesh& mesh, const Vertices& normals, int count, double radius = 14);

/// How deep a surface lies below a point, in rings and sectors around an axis: what faces look like from the nose.
struct PolarDepth {
  static constexpr int kRings = 6, kSectors = 36;
  std::array<std::array<double, kSectors>, kRings> depth{};  ///< mm along the axis; NaN: nothing there
};

/// Rings of 11 mm from 8 mm on. Sector 0 begins at `up`, a unit vector across the axis; they go on counter-clockwise
/// seen from outside.
PolarDepth polar_depth(const Mesh& mesh, const Vertices& normals, const Dome& dome, const Eigen::Vector3d& up);

/// One way of turning a reference about a dome's axis.
struct Turn {
  double angle = 0;     ///< radians
  double mismatch = 0;  ///< mm, mean over rings and sectors
};

/// The turns at which two depths agree best, at most `count` local minima, the best first.
std::vector<Turn> best_turns(const PolarDepth& reference, const PolarDepth& scan, int count);

}  // namespace facewright
