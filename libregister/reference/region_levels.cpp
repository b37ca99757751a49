// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>
#include <limits>
#include <set>

#include "libmodel/core/topology.h"
#include "libregister/reference/reference_face.h"
#include "libregister/reference/regions.h"
#include "libregister/subdivision/hierarchy.h"

namespace facewright {
namespace {

// Dijkstra [dijkstra1959] along the edges, from one vertex to another; empty if they are not connected.
std::vector<int> shortest_path(const Vertices& V, const Adjacency& neighbours, int from, int to) {
  std::vector<double> length(static_cast<size_t>(V.rows()), std::numeric_limits<double>::infinity());
  std::vector<int> before(length.size(), -1);
  std::set<std::pair<double, int>> open = {{0, from}};
  length[static_cast<size_t>(from)] = 0;
  while (!open.empty()) {
    const auto [d, v] = *open.begin();
    open.erase(open.begin());
    if (v == to) break;
    for (const int* n = neighbours.begin(v); n != neighbours.end(v); ++n) {
      const double further = d + (V.row(*n) - V.row(v)).norm();
      double& known = length[static_cast<size_t>(*n)];
      if (further >= known) continue;
      open.erase({known, *n});
      known = further;
      before[static_cast<size_t>(*n)] = v;
      open.insert({further, *n});
    }
  }
  std::vector<int> path;
  if (from != to && before[static_cast<size_t>(to)] < 0) return path;
  for (int v = to; v >= 0; v = before[static_cast<size_t>(v)]) path.push_back(v);
  std::reverse(path.begin(), path.end());
  return path;
}

std::vector<std::string> numbers(int first, int last) {
  std::vector<std::string> names;
  for (int i = first; first < last ? i <= last : i >= last; first < last ? ++i : --i)
    names.push_back(std::to_string(i));
  return names;
}

// From the ear to the chin, which is left out: it belongs to both sides.
std::vector<int> contour(const MultiresTemplate& reference, int ear) {
  std::vector<int> path =
      refine_path(reference, landmark_path(reference.level_mesh(0), reference.landmarks, numbers(ear, 9)));
  if (!path.empty()) path.pop_back();
  return path;
}

void add_contours(const MultiresTemplate& reference, RegionMap& regions) {
  std::vector<int> left = contour(reference, 17), right;
  if (reference.mirror.empty())
    right = contour(reference, 1);
  else
    for (const int v : left) right.push_back(reference.mirror[static_cast<size_t>(v)]);
  if (!left.empty()) regions.try_emplace("left_contour", std::move(left));
  if (!right.empty()) regions.try_emplace("right_contour", std::move(right));
}

}  // namespace

std::vector<int> landmark_path(const Mesh& mesh, const LandmarkSet& landmarks, const std::vector<std::string>& names) {
  const Adjacency neighbours = vertex_neighbours(mesh.V.rows(), mesh.F);
  std::vector<int> path;
  for (const std::string& name : names) {
    const auto mark = landmarks.find(name);
    if (mark == landmarks.end()) return {};
    const int v = nearest_corner(mark->second, mesh.F);
    if (path.empty()) {
      path.push_back(v);
      continue;
    }
    const std::vector<int> piece = shortest_path(mesh.V, neighbours, path.back(), v);
    if (piece.empty()) return {};
    path.insert(path.end(), piece.begin() + 1, piece.end());
  }
  return path;
}

std::vector<int> refine_path(const MultiresTemplate& reference, const std::vector<int>& base_path) {
  std::vector<int> path = base_path;
  const int base = reference.base_count();
  for (size_t i = 0; i < reference.parents.size(); ++i) {
    const VertexParents& p = reference.parents[i];
    if (!p.is_midpoint()) continue;
    for (size_t k = 0; k + 1 < path.size(); ++k)
      if ((path[k] == p.a && path[k + 1] == p.b) || (path[k] == p.b && path[k + 1] == p.a)) {
        path.insert(path.begin() + static_cast<std::ptrdiff_t>(k) + 1, base + static_cast<int>(i));
        break;
      }
  }
  return path;
}

RegionMap template_regions(const MultiresTemplate& reference, const RegionMap& base_regions) {
  const Mesh base = reference.level_mesh(0);
  const Mesh finest = reference.level_mesh(static_cast<int>(reference.levels.size()) - 1);
  // Marks refer to the base triangles: the places hold for every level.
  const Landmarks marks = locate(reference.landmarks, base.V, base.F);
  const size_t n = reference.mirror.empty() ? 0 : static_cast<size_t>(base.V.rows());
  const RegionMap derived = face_regions(base, marks, {reference.mirror.begin(), reference.mirror.begin() + n});
  RegionMap regions = face_regions(finest, marks, reference.mirror);
  for (const auto& [name, vertices] : base_regions) {
    const auto same = derived.find(name);
    const bool drawn_by_us = same != derived.end() && same->second == vertices && regions.count(name);
    if (!drawn_by_us && !name.ends_with("_contour")) regions[name] = refine_region(reference, vertices);
  }
  for (const char* border : {"rim", "mouth_slit"})
    if (const auto given = base_regions.find(border); given != base_regions.end())
      regions[border] = refine_region(reference, given->second);
  add_contours(reference, regions);
  return regions;
}

}  // namespace facewright
