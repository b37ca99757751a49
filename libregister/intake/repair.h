// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "libmodel/core/mesh.h"

namespace facewright {

/// What was wrong with a mesh and what was done about it.
struct RepairSummary {
  int non_finite = 0;        ///< triangles dropped: a corner's position is not a number
  int flipped = 0;           ///< triangles turned over: they disagreed with their neighbours, which are more
  int degenerate = 0;        ///< triangles dropped: repeated vertices or no area
  int duplicate = 0;         ///< triangles dropped: the same three vertices again
  int non_manifold = 0;      ///< triangles dropped: they would make an edge or vertex non-manifold
  int island_triangles = 0;  ///< triangles dropped with small islands
  int unused_vertices = 0;   ///< vertices dropped: no triangle is left that uses them
  int boundary_edges = 0;    ///< of the result; not repaired: edges with one triangle
  int holes = 0;             ///< of the result; not repaired: boundaries beside the longest
  bool anything() const {
    return non_finite + flipped + degenerate + duplicate + non_manifold + island_triangles + unused_vertices > 0;
  }
  std::string words() const;  ///< "12 degenerate triangles dropped, 3 holes left", or "in order"
};

struct RepairOptions {
  double least_island = 0.05;  ///< share of the largest component's triangles below which a component is dropped, 0..1
};

struct RepairResult {
  Mesh mesh;  ///< the remaining vertices keep their order; attributes follow
  RepairSummary summary;
};

/// Makes a scan an edge- and vertex-manifold triangle mesh without crumbs (OpenMesh's half-edge rules decide). A mesh
/// that is in order comes back unchanged. Throws InvalidInput if nothing is left. O(M log M).
RepairResult repair_mesh(const Mesh& mesh, const RepairOptions& options = {});

}  // namespace facewright
