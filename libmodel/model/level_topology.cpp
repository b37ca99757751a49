// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/level_topology.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <set>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

// The smallest index first, the turn kept.
std::array<int, 3> turned(int a, int b, int c) {
  std::array<int, 3> t = {a, b, c};
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

bool all_used(const Faces& F, int vertices) {
  std::vector<bool> used(static_cast<size_t>(vertices), false);
  for (Eigen::Index i = 0; i < F.size(); ++i) used[static_cast<size_t>(F.data()[i])] = true;
  return std::find(used.begin(), used.end(), false) == used.end();
}

int mirror_errors(const Faces& F, int vertices, const std::vector<int>& mirror) {
  int errors = 0;
  const auto image = [&](int v) { return mirror[static_cast<size_t>(v)]; };
  for (int v = 0; v < vertices; ++v)
    if (image(v) < 0 || image(v) >= vertices || image(image(v)) != v) ++errors;
  if (errors > 0) return errors;
  std::set<std::array<int, 3>> triangles;
  for (Eigen::Index f = 0; f < F.rows(); ++f) triangles.insert(turned(F(f, 0), F(f, 1), F(f, 2)));
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    errors += !triangles.count(turned(image(F(f, 0)), image(F(f, 2)), image(F(f, 1))));
  return errors;
}

}  // namespace

bool consistently_oriented(const Faces& F) {
  // The directed edges by their first vertex, which are few at each.
  std::vector<int> begin(static_cast<size_t>(F.size() > 0 ? F.maxCoeff() + 2 : 1), 0),
      to(static_cast<size_t>(F.size()));
  for (Eigen::Index i = 0; i < F.size(); ++i) ++begin[static_cast<size_t>(F.data()[i]) + 1];
  for (size_t v = 1; v < begin.size(); ++v) begin[v] += begin[v - 1];
  std::vector<int> end = begin;
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      const auto v = static_cast<size_t>(F(f, k));
      const int other = F(f, (k + 1) % 3);
      const auto first = to.begin() + begin[v], last = to.begin() + end[v];
      if (std::find(first, last, other) != last) return false;
      *last = other;
      ++end[v];
    }
  return true;
}

double facing(const Vertices& V, const Faces& F) {
  double seen = 0, area = 0;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const Eigen::Vector3d a = V.row(F(f, 0)), b = V.row(F(f, 1)), c = V.row(F(f, 2));
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    seen += normal.z();
    area += normal.norm();
  }
  return area > 0 ? seen / area : 0;
}

LevelTopology level_topology(const Faces& F, int vertices, const std::vector<int>& mirror) {
  LevelTopology t;
  t.vertices = vertices;
  t.triangles = static_cast<int>(F.rows());
  try {
    boundary_loops(F);
    t.boundary_edges = boundary_edge_count(F);
    t.euler = euler_characteristic(F);
    t.manifold = all_used(F, vertices);
  } catch (const InvalidInput&) {
    t.manifold = false;
  }
  t.oriented = consistently_oriented(F);
  t.has_mirror = !mirror.empty();
  if (t.has_mirror) t.mirror_errors = mirror_errors(F, vertices, mirror);
  return t;
}

std::vector<LevelTopology> level_topologies(const MorphableModel& model) {
  std::vector<LevelTopology> all;
  if (model.base_faces().rows() > 0 && model.base_vertex_count() < model.vertex_count(0))
    all.push_back(level_topology(model.base_faces(), model.base_vertex_count(), model.mirror()));
  for (int l = 0; l < model.level_count(); ++l)
    all.push_back(level_topology(model.faces(l), model.vertex_count(l), model.mirror()));
  return all;
}

}  // namespace facewright
