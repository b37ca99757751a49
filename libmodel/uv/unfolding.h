// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

// Private to this module: getting rid of flipped triangles.

struct UnfoldResult {
  TexCoords uv;
  int flips = 0;       ///< left over
  std::string method;  ///< "none needed", "vertex moves", "mean-value map on its border", "... on the convex hull"
};

/// Makes every triangle of a disc-shaped map positive, changing as little as it can: first moves single vertices into
/// the kernel of their neighbours, then solves for mean-value coordinates [floater2003] with the border of the map, at
/// last with the border on its convex hull, which cannot fold. `mirror` (N, or empty): keeps uv symmetric about u = 0.
UnfoldResult unfold(const Vertices& V, const Faces& F, const TexCoords& uv, const std::vector<int>& mirror, int sweeps);

/// uv_i <- mean of uv_i and the mirror image (u -> -u) of its partner's; no change for an empty mirror.
TexCoords symmetrised(const TexCoords& uv, const std::vector<int>& mirror);

int count_flips(const TexCoords& uv, const Faces& F);

}  // namespace facewright
