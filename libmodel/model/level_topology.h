// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/model/morphable_model.h"

namespace facewright {

/// What the triangles of one level are like.
struct LevelTopology {
  int vertices = 0, triangles = 0;
  int boundary_edges = 0, euler = 0;  ///< valid if manifold
  bool manifold = false;              ///< no edge has three triangles, no vertex two borders; every vertex is used
  bool oriented = false;              ///< neighbouring triangles turn the same way round
  bool has_mirror = false;
  int mirror_errors = 0;  ///< vertices whose partner's partner is another, triangles whose mirror image is none
  bool sound() const { return manifold && oriented && mirror_errors == 0; }
};

/// Of the triangles F over `vertices` vertices; `mirror` (at least as long, or empty) is their left-right table.
/// O(M log M).
LevelTopology level_topology(const Faces& F, int vertices, const std::vector<int>& mirror);

/// Neighbouring triangles turn the same way round: no directed edge occurs twice. Indices must be >= 0. O(M).
bool consistently_oriented(const Faces& F);

/// How much of the surface faces +z: the sum of the triangles' areas as seen from +z, those seen from behind negative,
/// over their whole area. About 0.6 for a face that is wound counter-clockwise as seen from outside, -0.6 the other way
/// round, 0 for a closed surface or none. O(M).
double facing(const Vertices& V, const Faces& F);

/// Of every level of the model, coarsest first; with the mesh that the coarsest was refined from in front, if the model
/// knows it (base_faces) and it is not a level itself.
std::vector<LevelTopology> level_topologies(const MorphableModel& model);

}  // namespace facewright
