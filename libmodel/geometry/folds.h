// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/topology.h"

namespace facewright {

/// Indices into `edge_list` of interior edges whose two triangles' normals differ by more than 90 degrees.
std::vector<int> folded_edges(const Vertices& V, const Faces& F, const std::vector<Edge>& edge_list);

}  // namespace facewright
