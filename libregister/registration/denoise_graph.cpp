// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/denoise_graph.h"

#include <algorithm>
#include <numeric>

namespace facewright {
namespace {

Adjacency faces_of_vertices(Eigen::Index vertex_count, const Faces& F) {
  Adjacency a;
  a.offsets.assign(static_cast<size_t>(vertex_count) + 1, 0);
  for (Eigen::Index k = 0; k < F.size(); ++k) ++a.offsets[F.data()[k] + 1];
  std::partial_sum(a.offsets.begin(), a.offsets.end(), a.offsets.begin());
  a.indices.resize(static_cast<size_t>(F.size()));
  std::vector<int> next(a.offsets.begin(), a.offsets.end() - 1);
  for (int f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) a.indices[static_cast<size_t>(next[static_cast<size_t>(F(f, k))]++)] = f;
  return a;
}

}  // namespace

ScanGraph scan_graph(Eigen::Index vertex_count, const Faces& F) {
  ScanGraph g;
  g.faces = faces_of_vertices(vertex_count, F);
  g.border.assign(static_cast<size_t>(vertex_count), 0);
  g.ring.offsets.push_back(0);
  g.border_ring.offsets.push_back(0);
  g.ring.indices.reserve(static_cast<size_t>(F.size()) * 2);
  std::vector<std::pair<int, int>> fan;  // neighbour, number of triangles it shares with the vertex
  for (int i = 0; i < vertex_count; ++i) {
    fan.clear();
    for (const int* f = g.faces.begin(i); f != g.faces.end(i); ++f)
      for (int k = 0; k < 3; ++k) {
        const int j = F(*f, k);
        if (j == i) continue;
        const auto known = std::find_if(fan.begin(), fan.end(), [j](const auto& p) { return p.first == j; });
        if (known == fan.end())
          fan.emplace_back(j, 1);
        else
          ++known->second;
      }
    for (const auto& [j, shared] : fan) {
      g.ring.indices.push_back(j);
      if (shared != 1) continue;
      g.border_ring.indices.push_back(j);
      g.border[static_cast<size_t>(i)] = 1;
    }
    g.ring.offsets.push_back(static_cast<int>(g.ring.indices.size()));
    g.border_ring.offsets.push_back(static_cast<int>(g.border_ring.indices.size()));
  }
  return g;
}

RingGatherer::RingGatherer(const ScanGraph& graph) : graph_(graph), stamp_(static_cast<size_t>(graph.ring.size()), 0) {}

const std::vector<int>& RingGatherer::around(int i, int rings) {
  ++mark_;
  stamp_[static_cast<size_t>(i)] = mark_;
  points_.assign(1, i);
  outer_ = 0;
  grow();
  points_.erase(points_.begin());
  outer_ = 0;
  for (int r = 1; r < rings; ++r) grow();
  return points_;
}

const std::vector<int>& RingGatherer::grow() {
  const size_t end = points_.size();
  for (size_t k = outer_; k < end; ++k) {
    const int v = points_[k];
    for (const int* j = graph_.ring.begin(v); j != graph_.ring.end(v); ++j) {
      if (stamp_[static_cast<size_t>(*j)] == mark_) continue;
      stamp_[static_cast<size_t>(*j)] = mark_;
      points_.push_back(*j);
    }
  }
  outer_ = end;
  return points_;
}

}  // namespace facewright
