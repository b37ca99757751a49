// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// Which triangle each texel of a texture map belongs to, row by row: depends on the map and its size alone, so one
/// serves every image of every face of a model's level.
struct IsomapTexels {
  struct Run {
    int triangle = -1, begin = 0, end = 0;  ///< columns [begin, end)
  };
  int size = 0;                ///< texels along each side
  TexCoords texels;            ///< (T x 2) rows of mesh.uv in texels: centres are whole numbers, y down
  Faces corners;               ///< (M x 3) rows of `texels` per triangle
  std::vector<Run> runs;       ///< by row, then column
  std::vector<int> row_start;  ///< (size + 1) index of each row's first run
  int count = 0;               ///< texels in the map
};

/// A texel belongs to the triangle that holds its centre, the first where triangles overlap. Throws InvalidInput
/// without texture coordinates or for sizes outside 8..8192. O(M + texels).
IsomapTexels isomap_texels(const Mesh& mesh, int size);

}  // namespace facewright
