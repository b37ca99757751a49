// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// Symmetry plane n.x = offset of a deformed reference. n points to the subject's left.
struct SymmetryPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();
  double offset = 0;

  Eigen::Vector3d reflect_direction(const Eigen::Vector3d& d) const { return d - 2 * normal.dot(d) * normal; }
  Eigen::Vector3d reflect_point(const Eigen::Vector3d& x) const { return x - 2 * (normal.dot(x) - offset) * normal; }
};

/// From the left-right pairs of `mirror`, an involution on the rows of V.
SymmetryPlane symmetry_plane(const Vertices& V, const std::vector<int>& mirror);

}  // namespace facewright
