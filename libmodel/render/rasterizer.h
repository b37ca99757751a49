// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <array>
#include <vector>

#include "libmodel/core/camera.h"
#include "libmodel/core/mesh.h"
#include "libmodel/render/projection.h"

namespace facewright {

struct RasterOptions {
  int width = 0, height = 0;   ///< pixels, > 0
  bool cull_backfaces = true;  ///< drop triangles that face away from the camera
};

/// What each pixel sees, row by row from the top.
struct Raster {
  int width = 0, height = 0;
  std::vector<int> triangle;                      ///< -1 where there is nothing
  std::vector<float> depth;                       ///< mm, as in ProjectedVertices: larger is nearer; -infinity if empty
  std::vector<std::array<float, 3>> barycentric;  ///< of the pixel's centre in its triangle

  size_t index(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
  bool inside(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
};

/// Z-buffer rasterisation. A pixel belongs to a triangle if its centre lies inside; on a shared edge to exactly one of
/// the two (top-left rule). Barycentric coordinates are those of the surface, not of the screen, in perspective too.
/// Equal depths go to the lower triangle index, so the result does not depend on anything but the input. Triangles with
/// corners that are not finite, or behind a perspective camera, are left out. O(M + covered pixels). Throws
/// InvalidInput for empty sizes or indices out of range.
Raster rasterize(const ProjectedVertices& projected, const Faces& F, const RasterOptions& options);
Raster rasterize(const Vertices& V, const Faces& F, const AffineCamera& camera, const RasterOptions& options);

/// The same for flat triangles with positions (N x 2) in pixels, whatever their orientation; where they overlap, the
/// lower index wins. For texture maps.
Raster rasterize_flat(const TexCoords& pixels, const Faces& F, int width, int height);

}  // namespace facewright
