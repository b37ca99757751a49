// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/image.h"
#include "libmodel/core/mesh.h"

namespace facewright {

/// The triangles of a texture map as dark lines on white, smoothed, `size` x `size` pixels, grey; v runs up the image.
Image uv_wireframe(const TexCoords& uv, const Faces& F, int size);

}  // namespace facewright
