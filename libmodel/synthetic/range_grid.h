// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstdint>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// A cylinder of samples about a vertical axis: columns over the angle, staggered rows over the height, every sample
/// moved a little from its place (jitter in cells), so that no two scans share a triangulation.
struct RangeGridLayout {
  double axis_z = -25;              ///< of the vertical axis x = 0, mm
  double radius = 95;               ///< at which a column is `spacing` wide, mm
  double spacing = 1.3;             ///< mm
  double half_angle = 1.6;          ///< radians to either side of straight ahead
  double bottom = -125, top = 100;  ///< mm
  double jitter = 0.25;             ///< cells
  std::uint64_t seed = 0;
};

/// Samples of the outermost surface and the triangles between neighbouring ones.
struct RangeSamples {
  std::vector<SurfacePoint> points;    ///< on the scanned mesh
  std::vector<Eigen::Vector2d> place;  ///< (angle, height) of each sample
  Faces F;                             ///< (M x 3), seen from outside counter-clockwise
};

RangeSamples sample_outermost(const Vertices& V, const Faces& F, const RangeGridLayout& layout);

}  // namespace facewright
