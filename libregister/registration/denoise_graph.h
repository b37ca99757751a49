// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/core/topology.h"

namespace facewright {

/// The neighbourhoods of a scan as its filters need them; built in O(N + M) without sorting.
struct ScanGraph {
  Adjacency faces;           ///< incident triangles per vertex, ascending
  Adjacency ring;            ///< neighbours per vertex, in the order of its triangles
  std::vector<char> border;  ///< 1: the vertex lies on an edge with one triangle
  Adjacency border_ring;     ///< neighbours along edges with one triangle
};

ScanGraph scan_graph(Eigen::Index vertex_count, const Faces& F);

/// Gathers the vertices around a vertex, nearest ring first; one per thread, reused from call to call.
class RingGatherer {
 public:
  explicit RingGatherer(const ScanGraph& graph);
  /// Vertices within `rings` edges of i, i itself left out. Valid until the next call.
  const std::vector<int>& around(int i, int rings);
  /// The same with one ring more.
  const std::vector<int>& grow();

 private:
  const ScanGraph& graph_;
  std::vector<int> stamp_, points_;
  size_t outer_ = 0;  // first vertex of the outermost ring
  int mark_ = 0;
};

}  // namespace facewright
