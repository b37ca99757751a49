// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// Lengths of the shortest paths over the surface from each source vertex to all vertices, (sources x N), exact on the
/// polyhedron [xin2009]. About 0.1 s per source at 850 vertices, growing faster than quadratically with N. Throws
/// InvalidInput if the mesh is not manifold or not connected.
Eigen::MatrixXd exact_geodesics(const Vertices& V, const Faces& F, const std::vector<int>& sources, int threads = 0);

}  // namespace facewright
