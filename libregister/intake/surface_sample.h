// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: points spread evenly over a mesh, for searches that need no more.
#pragma once

#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

struct SurfaceSample {
  Vertices P;                 ///< (n x 3) points on the surface
  Vertices N;                 ///< (n x 3) unit normals of their triangles, by the winding
  std::vector<int> triangle;  ///< (n)
};

/// About `count` points, evenly by area, in the order of the triangles; the same for the same mesh. Triangles without
/// area are passed over; empty if there is no area. O(M).
SurfaceSample sample_surface(const Vertices& V, const Faces& F, int count);

/// Normals averaged over cubes of side `cell`, (n x 3) unit: what noise and fine detail leave.
Vertices smooth_normals(const SurfaceSample& sample, double cell);

}  // namespace facewright
