// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// A block of the tri-quad mesh: the triangles `f` and `g` on both sides of the edge (a, b), or a triangle on its own
/// (g == -1, a == b == -1) that will be split at its centre.
struct TriangleBlock {
  int f = -1, g = -1;
  int a = -1, b = -1;
  bool is_pair() const { return g >= 0; }
};

/// All triangles of a mesh in blocks; blocks and their mirror images follow each other.
struct TrianglePairing {
  std::vector<TriangleBlock> blocks;  ///< in the order in which their centres become vertices
  int pairs = 0, singles = 0;         ///< 2 pairs + singles = triangles
};

/// Greedy longest-edge pairing (velho2001): edges by decreasing length (ties by index); if all its triangles are free,
/// an interior edge pairs them and a boundary edge makes its triangle a single. The rest become singles.
/// V (N x 3), F (M x 3) manifold and consistently oriented; mirror (N) an involution that maps triangles to triangles,
/// or empty. With a mirror the pairing is symmetric.
/// wanted_singles >= 0 asks for exactly that many singles: the pairs with the shortest diagonals (relative to their
/// other edges) are taken apart, or singles are joined along short augmenting paths (fewest re-paired triangles first,
/// then the longest diagonals). The result has as near a number as those moves reach: compare `singles`. O(M log M).
/// Throws InvalidInput.
TrianglePairing pair_triangles(const Vertices& V, const Faces& F, const std::vector<int>& mirror = {},
                               int wanted_singles = -1);

/// The mirror image of every triangle, (M). Throws InvalidInput if `mirror` is no involution of the vertices (a
/// reflection: it reverses orientation) that maps the triangles of F to triangles of F.
std::vector<int> mirrored_triangles(const Faces& F, const std::vector<int>& mirror);

}  // namespace facewright
