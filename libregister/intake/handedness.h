// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: which way round the triangles and the texture of a found face are.
#pragma once

#include "libmodel/core/mesh.h"
#include "libregister/intake/face_alignment.h"

namespace facewright {

struct SurfaceSides {
  double outward = 0;      ///< share of the face's points whose triangle shows outward by its winding
  double unmirrored = -1;  ///< share of those whose texture is the right way round seen from outside; -1: no texture
};

/// `scan.N` by the winding of mesh.F; texture coordinates with v up.
SurfaceSides surface_sides(const Mesh& mesh, const SurfaceSample& scan, const FaceAlignment& face);

}  // namespace facewright
