// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <string>
#include <vector>

#include "libmodel/core/errors.h"
#include "libregister/reference/reference_check.h"

namespace facewright {

int count_self_intersections(const Vertices& V, const Faces& F) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using SurfaceMesh = CGAL::Surface_mesh<Kernel::Point_3>;
  SurfaceMesh mesh;
  std::vector<SurfaceMesh::Vertex_index> index;
  for (Eigen::Index v = 0; v < V.rows(); ++v) index.push_back(mesh.add_vertex({V(v, 0), V(v, 1), V(v, 2)}));
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const auto at = [&](int k) { return index[static_cast<size_t>(F(f, k))]; };
    if (mesh.add_face(at(0), at(1), at(2)) == SurfaceMesh::null_face())
      throw InvalidInput("reference: triangle " + std::to_string(f) +
                         " makes the mesh no manifold: an edge with three triangles, or two that turn different ways");
  }
  std::vector<std::pair<SurfaceMesh::Face_index, SurfaceMesh::Face_index>> pairs;
  CGAL::Polygon_mesh_processing::self_intersections(mesh, std::back_inserter(pairs));
  return static_cast<int>(pairs.size());
}

}  // namespace facewright
