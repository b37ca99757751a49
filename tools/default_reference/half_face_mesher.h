// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "tools/default_reference/half_face_design.h"

namespace facewright::face_design {

struct HalfFaceMesh {
  std::vector<Vector3d> points;  ///< those of the design first
  std::vector<bool> midline, pinned;
  std::vector<std::array<int, 3>> triangles;  ///< counter-clockwise seen from outside
};

using WantedLength = std::function<double(const Vector3d&)>;

/// Adds free points, graded by the wanted length, up to point_count (another seed, other points); constrained Delaunay
/// triangles between them; then evens the mesh out on the surface (relaxation, edge flips, and a search for better
/// worst triangles).
HalfFaceMesh mesh_half_face(const HalfFaceDesign& design, int point_count, const WantedLength& wanted,
                            std::uint64_t seed);

/// Is q inside the closed polygon?
bool inside(const Vector2d& q, const std::vector<Vector2d>& polygon);

}  // namespace facewright::face_design
