// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: several pictures of one mesh made into one.
#pragma once

#include <vector>

#include "libmodel/core/image.h"
#include "libmodel/core/mesh.h"

namespace facewright {

/// Puts the pictures (1, 3 or 4 channels) beside each other, with a grey strip for triangles that have none, and moves
/// the mesh's texture coordinates, which become wedge coordinates. `of_triangle` (M): which picture, -1: none. An empty
/// picture counts as none. Coordinates outside 0..1 repeat.
Image merge_pictures(const std::vector<Image>& pictures, const std::vector<int>& of_triangle, Mesh* mesh);

}  // namespace facewright
