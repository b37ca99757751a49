// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/repair.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Utils/PropertyManager.hh>
#include <algorithm>
#include <array>
#include <numeric>
#include <utility>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libregister/intake/winding.h"

namespace facewright {
namespace {

using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<>;

bool is_degenerate(const Mesh& mesh, Eigen::Index f) {
  const int a = mesh.F(f, 0), b = mesh.F(f, 1), c = mesh.F(f, 2);
  return a == b || b == c || c == a;
}

// Triangles that repeat the vertices of an earlier one.
std::vector<bool> repeated_faces(const Faces& F) {
  std::vector<std::array<int, 3>> keys(static_cast<size_t>(F.rows()));
  for (size_t f = 0; f < keys.size(); ++f) {
    for (int k = 0; k < 3; ++k) keys[f][static_cast<size_t>(k)] = F(static_cast<Eigen::Index>(f), k);
    std::sort(keys[f].begin(), keys[f].end());
  }
  std::vector<int> order(keys.size());
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](int f) -> const auto& { return keys[static_cast<size_t>(f)]; };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
  std::vector<bool> repeated(keys.size(), false);
  for (size_t i = 1; i < order.size(); ++i)
    repeated[static_cast<size_t>(order[i])] = key(order[i]) == key(order[i - 1]);
  return repeated;
}

// Triangles that can be added to a half-edge structure one after the other.
std::vector<int> manifold_faces(const Mesh& mesh, RepairSummary* s) {
  // OpenMesh tells of each refused triangle on its error stream; the summary counts them instead.
  omerr().disable();
  HalfEdgeMesh half_edges;
  half_edges.reserve(static_cast<size_t>(mesh.V.rows()), static_cast<size_t>(mesh.F.rows() * 3 / 2 + 16),
                     static_cast<size_t>(mesh.F.rows()));
  std::vector<bool> finite(static_cast<size_t>(mesh.V.rows()));
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i) {
    half_edges.add_vertex(HalfEdgeMesh::Point(0, 0, 0));
    finite[static_cast<size_t>(i)] = mesh.V.row(i).allFinite();
  }
  const std::vector<bool> repeated = repeated_faces(mesh.F);
  std::vector<int> kept;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    if (is_degenerate(mesh, f)) {
      ++s->degenerate;
      continue;
    }
    const auto is_finite = [&](int k) { return finite[static_cast<size_t>(mesh.F(f, k))]; };
    if (!is_finite(0) || !is_finite(1) || !is_finite(2)) {
      ++s->non_finite;
      continue;
    }
    if (repeated[static_cast<size_t>(f)]) {
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

void turn_over(Faces* F, const std::vector<int>& triangles) {
  for (const int f : triangles) std::swap((*F)(f, 1), (*F)(f, 2));
}

// Boundary edges of a manifold mesh and the loops they make, by their vertices.
void count_holes(const Mesh& mesh, RepairSummary* s) {
  const Faces across = face_neighbours(mesh.F);
  std::vector<int> next(static_cast<size_t>(mesh.V.rows()), -1);
  for (Eigen::Index f = 0; f < across.rows(); ++f)
    for (int k = 0; k < 3; ++k)
      if (across(f, k) < 0) ++s->boundary_edges, next[static_cast<size_t>(mesh.F(f, k))] = mesh.F(f, (k + 1) % 3);
  int loops = 0;
  for (size_t v = 0; v < next.size(); ++v) {
    if (next[v] < 0) continue;
    ++loops;
    for (int at = static_cast<int>(v); at >= 0;) at = std::exchange(next[static_cast<size_t>(at)], -1);
  }
  s->holes = std::max(0, loops - 1);
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

std::string RepairSummary::words() const {
  std::string text;
  const auto add = [&](int count, const char* what) {
    if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + what;
  };
  add(non_finite, " triangles without finite positions dropped");
  add(degenerate, " degenerate triangles dropped");
  add(duplicate, " duplicate triangles dropped");
  add(flipped, " triangles turned over");
  add(non_manifold, " non-manifold triangles dropped");
  add(island_triangles, " triangles of small islands dropped");
  add(unused_vertices, " unused vertices dropped");
  add(holes, " holes left");
  return text.empty() ? "in order" : text;
}

RepairResult repair_mesh(const Mesh& original, const RepairOptions& options) {
  RepairResult result;
  RepairSummary& s = result.summary;
  const std::vector<int> turned = inconsistent_triangles(original.F);
  Mesh copy;
  if (!turned.empty()) {
    copy = original;
    turn_over(&copy.F, turned);
    if (copy.uv_faces.rows() > 0) turn_over(&copy.uv_faces, turned);
    s.flipped = static_cast<int>(turned.size());
  }
  const Mesh& mesh = turned.empty() ? original : copy;
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
    count_holes(out, &s);
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
  count_holes(out, &s);
  return result;
}

}  // namespace facewright
