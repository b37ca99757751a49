// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/image.h"
#include "libmodel/core/mesh.h"

namespace facewright {

/// Vertex colours (linear RGB, clamped to 0..1) painted into the texture map of a mesh with one texture coordinate per
/// vertex: an sRGB image of size x size pixels. Texels that no triangle covers continue the nearest colours, so that
/// smaller versions of the image do not bleed at the borders. Throws InvalidInput without colours or coordinates, or
/// for a size outside 16..8192. O(size^2 + M).
Image baked_texture(const Mesh& mesh, int size);

}  // namespace facewright
