// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/uv/exact_geodesics.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_shortest_path.h>

#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using SurfaceMesh = CGAL::Surface_mesh<Kernel::Point_3>;
using ShortestPath = CGAL::Surface_mesh_shortest_path<CGAL::Surface_mesh_shortest_path_traits<Kernel, SurfaceMesh>>;

constexpr int kSourcesPerJob = 8;

SurfaceMesh surface_mesh(const Vertices& V, const Faces& F) {
  using Index = SurfaceMesh::Vertex_index;
  SurfaceMesh mesh;
  for (Eigen::Index v = 0; v < V.rows(); ++v) mesh.add_vertex({V(v, 0), V(v, 1), V(v, 2)});
  const auto index = [](int v) { return Index(static_cast<SurfaceMesh::size_type>(v)); };
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    if (mesh.add_face(index(F(f, 0)), index(F(f, 1)), index(F(f, 2))) == SurfaceMesh::null_face())
      throw InvalidInput("geodesics: triangle " + std::to_string(f) + " makes the mesh non-manifold");
  return mesh;
}

}  // namespace

Eigen::MatrixXd exact_geodesics(const Vertices& V, const Faces& F, const std::vector<int>& sources, int threads) {
  const SurfaceMesh mesh = surface_mesh(V, F);
  const int count = static_cast<int>(sources.size());
  Eigen::MatrixXd D(count, V.rows());
  // The search structure is not safe to share between threads: every job has its own.
  parallel_for((count + kSourcesPerJob - 1) / kSourcesPerJob, threads, [&](int job) {
    ShortestPath paths(mesh);
    for (int s = job * kSourcesPerJob; s < std::min(count, (job + 1) * kSourcesPerJob); ++s) {
      paths.remove_all_source_points();
      paths.add_source_point(
          SurfaceMesh::Vertex_index(static_cast<SurfaceMesh::size_type>(sources[static_cast<size_t>(s)])));
      for (const auto v : mesh.vertices()) {
        const double d = paths.shortest_distance_to_source_points(v).first;
        if (d < 0) throw InvalidInput("geodesics: the mesh is not connected");
        D(s, static_cast<Eigen::Index>(v.idx())) = d;
      }
    }
  });
  return D;
}

}  // namespace facewright
