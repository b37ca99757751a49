// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright::test {

/// What makes a triangle mesh conforming, counted from the triangles alone.
struct Conformity {
  std::string trouble;  ///< empty: manifold, consistently oriented, every vertex in use, so no T-vertex
  int boundary_edges = 0;
  int euler = 0;
};

inline Conformity conformity(const Faces& F, int vertices) {
  std::vector<std::uint64_t> half_edges;
  half_edges.reserve(static_cast<size_t>(F.size()));
  std::vector<char> used(static_cast<size_t>(vertices), 0);
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      const auto a = static_cast<std::uint64_t>(F(f, k)), b = static_cast<std::uint64_t>(F(f, (k + 1) % 3));
      half_edges.push_back((std::min(a, b) << 33) | (std::max(a, b) << 1) | (a < b ? 0u : 1u));
      used[a] = 1;
    }
  std::sort(half_edges.begin(), half_edges.end());
  Conformity c;
  if (std::adjacent_find(half_edges.begin(), half_edges.end()) != half_edges.end())
    c.trouble = "an edge has three triangles, or two that turn different ways";
  if (std::find(used.begin(), used.end(), 0) != used.end()) c.trouble = "a vertex is in no triangle";
  int edges = 0;
  for (size_t i = 0; i < half_edges.size(); ++i, ++edges) {
    const bool both = i + 1 < half_edges.size() && (half_edges[i] >> 1) == (half_edges[i + 1] >> 1);
    if (both)
      ++i;
    else
      ++c.boundary_edges;
  }
  c.euler = vertices - edges + static_cast<int>(F.rows());
  return c;
}

}  // namespace facewright::test
