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
  int flips = 0;              ///< left over
  bool simple_border = true;  ///< the border does not cross itself
  std::string method;         ///< "none needed", "vertex moves", "mean-value map on its border", "... on a circle"
  /// A disc without flips whose border does not cross itself is covered once.
  bool one_to_one() const { return flips == 0 && simple_border; }
};

/// Makes a map of a disc one to one, changing as little as it can: first moves single vertices into the kernel of their
/// neighbours, then solves for mean-value coordinates [floater2003] with the border of the map, at last with the border
/// on a circle, which cannot fold (with uniform weights if rounding still folds it). `mirror` (N, or empty): keeps uv
/// symmetric about u = 0; a map that is not one to one can be left over only if the triangles are not symmetric.
UnfoldResult unfold(const Vertices& V, const Faces& F, const TexCoords& uv, const std::vector<int>& mirror, int sweeps);

/// uv_i <- mean of uv_i and the mirror image (u -> -u) of its partner's; no change for an empty mirror.
TexCoords symmetrised(const TexCoords& uv, const std::vector<int>& mirror);

/// Triangles turned over or with next to no area.
int count_flips(const TexCoords& uv, const Faces& F);

/// Whether no two sides of the closed polygon meet, neighbours aside. O(B^2).
bool border_is_simple(const TexCoords& uv, const std::vector<int>& loop);

}  // namespace facewright
