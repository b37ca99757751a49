// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/core/topology.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <string>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

struct HalfEdge {
  int v0, v1, face, corner;
};

// All half-edges, sorted by undirected edge and then by face: equal keys are neighbours.
std::vector<HalfEdge> sorted_half_edges(const Faces& F) {
  std::vector<HalfEdge> h;
  h.reserve(static_cast<size_t>(F.size()));
  for (int f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      const int a = F(f, k), b = F(f, (k + 1) % 3);
      h.push_back({std::min(a, b), std::max(a, b), f, k});
    }
  std::sort(h.begin(), h.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.v0, a.v1, a.face) < std::tie(b.v0, b.v1, b.face);
  });
  return h;
}

bool same_edge(const HalfEdge& a, const HalfEdge& b) { return a.v0 == b.v0 && a.v1 == b.v1; }

Adjacency from_pairs(Eigen::Index n, std::vector<std::pair<int, int>>& pairs) {
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  Adjacency a;
  a.offsets.assign(static_cast<size_t>(n) + 1, 0);
  a.indices.reserve(pairs.size());
  for (const auto& [i, j] : pairs) {
    ++a.offsets[i + 1];
    a.indices.push_back(j);
  }
  std::partial_sum(a.offsets.begin(), a.offsets.end(), a.offsets.begin());
  return a;
}

}  // namespace

std::vector<Edge> edges(const Faces& F) {
  const auto h = sorted_half_edges(F);
  std::vector<Edge> result;
  result.reserve(h.size() / 2 + 1);
  for (size_t i = 0; i < h.size();) {
    size_t j = i + 1;
    while (j < h.size() && same_edge(h[i], h[j])) ++j;
    if (j - i > 2)
      throw InvalidInput("topology: " + std::to_string(j - i) + " triangles share the edge " + std::to_string(h[i].v0) +
                         "-" + std::to_string(h[i].v1) + "; repair the mesh first");
    result.push_back({h[i].v0, h[i].v1, h[i].face, j - i == 2 ? h[i + 1].face : -1});
    i = j;
  }
  return result;
}

Adjacency vertex_neighbours(Eigen::Index vertex_count, const Faces& F) {
  std::vector<std::pair<int, int>> pairs;
  pairs.reserve(static_cast<size_t>(F.size()) * 2);
  for (int f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      const int a = F(f, k), b = F(f, (k + 1) % 3);
      pairs.emplace_back(a, b);
      pairs.emplace_back(b, a);
    }
  return from_pairs(vertex_count, pairs);
}

Adjacency vertex_faces(Eigen::Index vertex_count, const Faces& F) {
  std::vector<std::pair<int, int>> pairs;
  pairs.reserve(static_cast<size_t>(F.size()));
  for (int f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) pairs.emplace_back(F(f, k), f);
  return from_pairs(vertex_count, pairs);
}

Faces face_neighbours(const Faces& F) {
  Faces result = Faces::Constant(F.rows(), 3, -1);
  const auto h = sorted_half_edges(F);
  for (size_t i = 0; i + 1 < h.size(); ++i) {
    const bool pair = same_edge(h[i], h[i + 1]) && (i + 2 == h.size() || !same_edge(h[i + 1], h[i + 2])) &&
                      (i == 0 || !same_edge(h[i - 1], h[i]));
    if (!pair) continue;
    result(h[i].face, h[i].corner) = h[i + 1].face;
    result(h[i + 1].face, h[i + 1].corner) = h[i].face;
  }
  return result;
}

std::vector<bool> boundary_vertices(Eigen::Index vertex_count, const Faces& F) {
  std::vector<bool> flag(static_cast<size_t>(vertex_count), false);
  const auto h = sorted_half_edges(F);
  for (size_t i = 0; i < h.size(); ++i) {
    const bool alone = (i == 0 || !same_edge(h[i - 1], h[i])) && (i + 1 == h.size() || !same_edge(h[i], h[i + 1]));
    if (alone) flag[h[i].v0] = flag[h[i].v1] = true;
  }
  return flag;
}

std::vector<std::vector<int>> boundary_loops(const Faces& F) {
  const Faces neighbours = face_neighbours(F);
  std::map<int, int> next;
  for (int f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k)
      if (neighbours(f, k) < 0 && !next.emplace(F(f, k), F(f, (k + 1) % 3)).second)
        throw InvalidInput("topology: boundary vertex " + std::to_string(F(f, k)) + " is not manifold");
  std::vector<std::vector<int>> loops;
  while (!next.empty()) {
    std::vector<int> loop;
    int v = next.begin()->first;
    for (auto it = next.find(v); it != next.end(); it = next.find(v)) {
      loop.push_back(v);
      v = it->second;
      next.erase(it);
    }
    loops.push_back(std::move(loop));
  }
  std::stable_sort(loops.begin(), loops.end(), [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return loops;
}

Components connected_components(Eigen::Index vertex_count, const Faces& F) {
  std::vector<int> parent(static_cast<size_t>(vertex_count));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (int f = 0; f < F.rows(); ++f)
    for (int k = 1; k < 3; ++k) {
      const int a = root(F(f, 0)), b = root(F(f, k));
      parent[std::max(a, b)] = std::min(a, b);
    }
  Components c;
  c.vertex_label.assign(parent.size(), -1);
  for (int v = 0; v < static_cast<int>(parent.size()); ++v) {
    const int r = root(v);  // the smallest index of its component, so it was labelled first
    c.vertex_label[v] = r == v ? c.count++ : c.vertex_label[r];
  }
  return c;
}

int euler_characteristic(const Faces& F) {
  std::vector<int> used(F.data(), F.data() + F.size());
  std::sort(used.begin(), used.end());
  const auto v = std::unique(used.begin(), used.end()) - used.begin();
  return static_cast<int>(v) - static_cast<int>(edges(F).size()) + static_cast<int>(F.rows());
}

int boundary_edge_count(const Faces& F) {
  const auto all = edges(F);
  return static_cast<int>(std::count_if(all.begin(), all.end(), [](const Edge& e) { return e.is_boundary(); }));
}

}  // namespace facewright
