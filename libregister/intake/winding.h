// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: triangles that disagree with their neighbours about which side is outside.
#pragma once

#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// Triangles to turn over so that neighbours agree, ascending: in each connected part the minority (by count). Edges of
/// more than two triangles connect nothing; parts that cannot be oriented keep a seam. O(M log M).
std::vector<int> inconsistent_triangles(const Faces& F);

}  // namespace facewright
