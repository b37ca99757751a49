// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/geometry/folds.h"

#include "libmodel/geometry/normals.h"

namespace facewright {

std::vector<int> folded_edges(const Vertices& V, const Faces& F, const std::vector<Edge>& edge_list) {
  const Vertices N = face_normals(V, F);
  std::vector<int> folded;
  for (size_t e = 0; e < edge_list.size(); ++e) {
    const Edge& edge = edge_list[e];
    if (!edge.is_boundary() && N.row(edge.f0).dot(N.row(edge.f1)) < 0) folded.push_back(static_cast<int>(e));
  }
  return folded;
}

}  // namespace facewright
