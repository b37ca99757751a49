// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/core/topology.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <string>
#include <tuple>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

struct HalfEdge {
  int v0, v1, face, corner;
};

// Offsets of consecutive rows from their lengths, which stand one place late.
std::vector<int> to_offsets(std::vector<int> lengths) {
  std::partial_sum(lengths.begin(), lengths.end(), lengths.begin());
  return lengths;
}

// All half-edges, sorted by undirected edge and then by face: equal keys are neighbours. Sorted into a bucket per
// vertex first, so the whole costs O(M).
std::vector<HalfEdge> sorted_half_edges(const Faces& F) {
  if (F.size() == 0) return {};
  if (F.minCoeff() < 0) throw InvalidInput("topology: a triangle has a negative index");
  std::vector<int> lengths(static_cast<size_t>(F.maxCoeff()) + 2, 0);
  for (int f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) ++lengths[std::min(F(f, k), F(f, (k + 1) % 3)) + 1];
  const std::vector<int> offsets = to_offsets(std::move(lengths));
  std::vector<int> next(offsets.begin(), offsets.end() - 1);
  std::vector<HalfEdge> h(static_cast<size_t>(F.size()));
  for (int f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      const int a = F(f, k), b = F(f, (k + 1) % 3);
      h[next[std::min(a, b)]++] = {std::min(a, b), std::max(a, b), f, k};
    }
  for (size_t v = 0; v + 1 < offsets.size(); ++v)
    std::sort(h.begin() + offsets[v], h.begin() + offsets[v + 1],
              [](const HalfEdge& a, const HalfEdge& b) { return std::tie(a.v1, a.face) < std::tie(b.v1, b.face); });
  return h;
}

bool same_edge(const HalfEdge& a, const HalfEdge& b) { return a.v0 == b.v0 && a.v1 == b.v1; }

// Sorts every row and takes out what stands there twice.
Adjacency sorted_rows(const std::vector<int>& offsets, std::vector<int> indices) {
  Adjacency a;
  a.offsets.reserve(offsets.size());
  a.offsets.push_back(0);
  int end = 0;
  for (size_t i = 0; i + 1 < offsets.size(); ++i) {
    std::sort(indices.begin() + offsets[i], indices.begin() + offsets[i + 1]);
    for (int k = offsets[i]; k < offsets[i + 1]; ++k)
      if (end == a.offsets.back() || indices[k] != indices[end - 1]) indices[end++] = indices[k];
    a.offsets.push_back(end);
  }
  indices.resize(static_cast<size_t>(end));
  a.indices = std::move(indices);
  return a;
}

// Where each vertex's row starts if every corner gives it `each` entries.
std::vector<int> corner_offsets(Eigen::Index vertex_count, const Faces& F, int each) {
  std::vector<int> lengths(static_cast<size_t>(vertex_count) + 1, 0);
  for (Eigen::Index k = 0; k < F.size(); ++k) lengths[F.data()[k] + 1] += each;
  return to_offsets(std::move(lengths));
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
  const std::vector<int> offsets = corner_offsets(vertex_count, F, 2);
  std::vector<int> next(offsets.begin(), offsets.end() - 1), indices(static_cast<size_t>(offsets.back()));
  for (int f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k)
      for (const int other : {1, 2}) indices[next[F(f, k)]++] = F(f, (k + other) % 3);
  return sorted_rows(offsets, std::move(indices));
}

Adjacency vertex_faces(Eigen::Index vertex_count, const Faces& F) {
  const std::vector<int> offsets = corner_offsets(vertex_count, F, 1);
  std::vector<int> next(offsets.begin(), offsets.end() - 1), indices(static_cast<size_t>(offsets.back()));
  for (int f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) indices[next[F(f, k)]++] = f;
  return sorted_rows(offsets, std::move(indices));
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
