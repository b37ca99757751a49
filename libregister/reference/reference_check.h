// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libregister/reference/reference_face.h"

namespace facewright {

/// What a base mesh for the 4-8 hierarchy is judged by.
struct ReferenceCheck {
  int vertices = 0, triangles = 0, boundary_edges = 0, boundary_loops = 0, components = 0;
  int euler_characteristic = 0;                ///< 0 with an open mouth slit, 1 without
  double smallest_angle_deg = 0;               ///< degrees, of all triangles
  double sharpest_fold_deg = 0;                ///< degrees between the normals of neighbouring triangles
  int self_intersections = 0;                  ///< pairs of triangles that cross
  bool symmetric = false;                      ///< the mirror table is an involution that maps triangles to triangles
  double largest_asymmetry = 0;                ///< mm, of a vertex from its partner's reflection; 0 means exactly
  double shortest_edge = 0, longest_edge = 0;  ///< mm
};

/// Measures a reference face. Throws InvalidInput on a mesh that is not manifold.
ReferenceCheck check_reference(const ReferenceFace& face);

/// Pairs of triangles of a mesh that intersect other than in what they share (CGAL, exact predicates). O(M log M).
/// Throws InvalidInput on a mesh that is not manifold: a triangle left out would hide what it crosses.
int count_self_intersections(const Vertices& V, const Faces& F);

}  // namespace facewright
