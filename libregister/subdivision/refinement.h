// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <functional>

#include "libregister/subdivision/four_eight_mesh.h"

namespace facewright {

/// How badly the base edge of a triangle wants to be split: larger first. Must depend on nothing but the edge's ends
/// and their surroundings in the mesh, and be the same for mirror images.
using RefinementCriterion = std::function<double(const FourEightMesh&, int triangle)>;

/// length * (1 + bend_weight * |bend|): long edges first, on bent surface sooner. Weight per radian, >= 0; with 0 the
/// edge length alone.
RefinementCriterion bent_length_criterion(double bend_weight = 2.0);

/// What a refinement must hit exactly.
struct RefinementTarget {
  int vertices = 0;
  int boundary_edges = -1;  ///< -1: as they come. Triangles = 2 vertices - boundary edges - 2 (Euler characteristic)
};

/// Bisects where the criterion is largest until the target is hit exactly. The last few bisections are chosen so that
/// the vertex count comes out; with symmetry an odd number needs a bisection on the midline. With a wanted number of
/// boundary edges, the border is refined at an even pace beside the interior, its longest (by the criterion) edges
/// first. O(n log n). Throws InvalidInput if the target is below the present counts or cannot be hit: away from the
/// midline, a symmetric mesh gains boundary edges in pairs.
void refine_to(FourEightMesh& mesh, const RefinementTarget& target,
               const RefinementCriterion& criterion = bent_length_criterion());
inline void refine_to(FourEightMesh& mesh, int target_vertices,
                      const RefinementCriterion& criterion = bent_length_criterion()) {
  refine_to(mesh, RefinementTarget{target_vertices, -1}, criterion);
}

}  // namespace facewright
