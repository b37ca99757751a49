// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/multires_template.h"
#include "libregister/subdivision/refinement.h"

namespace facewright {

/// How far faces deviate from coarser 4-8 meshes. Every adaptive 4-8 mesh makes some of the bisections of the uniform
/// mesh with the same start; a bisection is known by its new vertex, and this by the two ends of the base edge.
struct DeviationTable {
  int start_count = 0;                 ///< vertices of the mesh it begins with
  std::vector<VertexParents> parents;  ///< of vertex start_count + i of the uniform mesh
  /// mm^4, the same rows: what is left if the bisection is not made, that is the squared distance between faces and the
  /// one or two triangles at the base edge, integrated over the area, mean over the faces.
  std::vector<double> deviations;
  std::vector<std::vector<std::pair<int, int>>> middles;  ///< per vertex a: (b, vertex on the middle) of edges a < b

  int midpoint(int a, int b) const;  ///< the vertex on the middle of edge (a, b), or -1
};

/// Compares every coarser 4-8 mesh with faces registered on the uniform one. `start` is the tri-quad mesh; faces (n x
/// 3) each in a frame of its own, n the vertex count after some uniform steps. Distances are taken along the normals of
/// the faces, at points of equal parameter. With symmetry both sides get the mean of both. O(faces * n * steps): about
/// 0.25 s for 12 faces of 54208 vertices. Throws InvalidInput if no number of uniform steps gives n vertices.
DeviationTable measure_deviation(const FourEightMesh& start, const std::vector<Vertices>& faces);

struct DeviationCriterionOptions {
  /// 1/mm, >= 0: deviation that an edge of length L is taken to have besides what was measured, length_weight * L^2.
  /// It keeps flat parts from staying coarse and goes on where the faces are not fine enough to tell.
  double length_weight = 0.0005;
};

/// Those bisections first that leave the most deviation if not made. For meshes that began as the table's did.
/// Throws InvalidInput on a negative weight.
RefinementCriterion deviation_criterion(DeviationTable table, const DeviationCriterionOptions& options = {});

/// Where the vertices of a hierarchy lie on a face of the uniform mesh (n x 3), (N x 3): its own vertices where the
/// uniform mesh has them, midpoints where the hierarchy is finer. For hierarchies that began as the table's did.
Vertices on_hierarchy(const DeviationTable& table, const Vertices& face, const MultiresTemplate& hierarchy);

}  // namespace facewright
