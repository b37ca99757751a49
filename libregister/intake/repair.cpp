// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/repair.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Utils/PropertyManager.hh>
#include <algorithm>
#include <array>
#include <set>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"

namespace facewright {
namespace {

using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<>;

bool is_degenerate(const Mesh& mesh, Eigen::Index f) {
  const int a = mesh.F(f, 0), b = mesh.F(f, 1), c = mesh.F(f, 2);
  return a == b || b == c || c == a;
}

// Triangles that can be added to a half-edge structure one after the other.
std::vector<int> manifold_faces(const Mesh& mesh, RepairSummary* s) {
  // OpenMesh tells of each refused triangle on its error stream; the summary counts them instead.
  omerr().disable();
  HalfEdgeMesh half_edges;
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i) half_edges.add_vertex(HalfEdgeMesh::Point(0, 0, 0));
  std::set<std::array<int, 3>> seen;
  std::vector<int> kept;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    if (is_degenerate(mesh, f)) {
      ++s->degenerate;
      continue;
    }
    std::array<int, 3> key = {mesh.F(f, 0), mesh.F(f, 1), mesh.F(f, 2)};
    std::sort(key.begin(), key.end());
    if (!seen.insert(key).second) {
      ++s->duplicate;
      continue;
    }
    const auto handle = half_edges.add_face(half_edges.vertex_handle(static_cast<unsigned>(mesh.F(f, 0))),
                                            half_edges.vertex_handle(static_cast<unsigned>(mesh.F(f, 1))),
                                            half_edges.vertex_handle(static_cast<unsigned>(mesh.F(f, 2))));
    if (handle.is_valid())
      kept.push_back(static_cast<int>(f));
    else
      ++s->non_manifold;
  }
  return kept;
}

Faces take_rows(const Faces& F, const std::vector<int>& rows) {
  Faces out(static_cast<Eigen::Index>(rows.size()), 3);
  for (size_t i = 0; i < rows.size(); ++i) out.row(static_cast<Eigen::Index>(i)) = F.row(rows[i]);
  return out;
}

// Leaves out components with few triangles.
std::vector<int> large_components(const Mesh& mesh, const std::vector<int>& faces, double least, RepairSummary* s) {
  const Faces F = take_rows(mesh.F, faces);
  const Components components = connected_components(mesh.V.rows(), F);
  std::vector<int> count(static_cast<size_t>(components.count), 0);
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    ++count[static_cast<size_t>(components.vertex_label[static_cast<size_t>(F(f, 0))])];
  const double bound = least * *std::max_element(count.begin(), count.end());
  std::vector<int> kept;
  for (size_t i = 0; i < faces.size(); ++i) {
    const int n =
        count[static_cast<size_t>(components.vertex_label[static_cast<size_t>(F(static_cast<Eigen::Index>(i), 0))])];
    if (n >= bound)
      kept.push_back(faces[i]);
    else
      ++s->island_triangles;
  }
  return kept;
}

}  // namespace

RepairResult repair_mesh(const Mesh& mesh, const RepairOptions& options) {
  RepairResult result;
  RepairSummary& s = result.summary;
  std::vector<int> faces = manifold_faces(mesh, &s);
  if (faces.empty()) throw InvalidInput("repair: no usable triangle in the mesh");
  faces = large_components(mesh, faces, options.least_island, &s);
  std::vector<int> renumber(static_cast<size_t>(mesh.V.rows()), -1);
  for (const int f : faces)
    for (int k = 0; k < 3; ++k) renumber[static_cast<size_t>(mesh.F(f, k))] = 0;
  int used = 0;
  for (int& r : renumber)
    if (r == 0) r = used++;
  s.unused_vertices = static_cast<int>(mesh.V.rows()) - used;
  Mesh& out = result.mesh;
  if (!s.anything()) {
    out = mesh;
    return result;
  }
  out.V.resize(used, 3);
  if (mesh.has_colours()) out.colours.resize(used, 3);
  const bool per_vertex_uv = mesh.has_uv() && mesh.uv_faces.rows() == 0;
  out.uv = mesh.uv;
  if (per_vertex_uv) out.uv.resize(used, 2);
  for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) {
    const int r = renumber[static_cast<size_t>(v)];
    if (r < 0) continue;
    out.V.row(r) = mesh.V.row(v);
    if (mesh.has_colours()) out.colours.row(r) = mesh.colours.row(v);
    if (per_vertex_uv) out.uv.row(r) = mesh.uv.row(v);
  }
  out.F = take_rows(mesh.F, faces);
  for (Eigen::Index i = 0; i < out.F.size(); ++i) out.F.data()[i] = renumber[static_cast<size_t>(out.F.data()[i])];
  if (mesh.uv_faces.rows() > 0) out.uv_faces = take_rows(mesh.uv_faces, faces);
  return result;
}

}  // namespace facewright
