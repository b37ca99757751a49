// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

// Private to this module: the surface whose distances are measured.

/// A mesh with its inner holes closed by fans; the added centres follow the given vertices.
struct Disc {
  Vertices V;
  Faces F;
  std::vector<int> mirror;  ///< of all vertices, or empty
};

/// Closes every hole but the longest border. Throws InvalidInput unless the result is one connected disc.
Disc close_holes(const Vertices& V, const Faces& F, const std::vector<int>& mirror);

/// Whether the triangles are the same set after exchanging every vertex with its partner.
bool is_symmetric(const Faces& F, const std::vector<int>& mirror);

/// The mean of the shape and its mirror image, moved onto each other: V made symmetric up to a rigid motion.
Vertices symmetric_shape(const Vertices& V, const std::vector<int>& mirror);

/// V, moved at random by a ten-thousandth of an edge if a triangle has no area worth the name: shortest paths lose
/// their way on such. The same for the same input; symmetric if the mirror is given.
Vertices without_needles(const Vertices& V, const Faces& F, const std::vector<int>& mirror);

/// `count` vertices far from each other (greedy, straight-line distances, ties to the lowest index), ascending. With a
/// mirror, partners come together.
std::vector<int> spread_vertices(const Vertices& V, const std::vector<int>& mirror, int count);

}  // namespace facewright
