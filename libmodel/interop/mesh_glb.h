// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "libmodel/core/image.h"
#include "libmodel/core/mesh.h"

namespace facewright {

/// A mesh as binary glTF 2.0 in metres with normals: textured by `texture` through its texture coordinates if both are
/// there (transparency is dropped: a viewer shows the colours that hidden texels were given), else with its vertex
/// colours. Wedge coordinates split vertices at seams. Throws InvalidInput for a mesh that `validate` rejects.
std::string mesh_glb_bytes(const Mesh& mesh, const Image& texture = {});

}  // namespace facewright
