// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/core/mesh.h"

#include <string>

#include "libmodel/core/errors.h"

namespace facewright {

void validate(const Mesh& mesh) {
  const auto n = mesh.V.rows();
  if (!mesh.V.allFinite()) throw InvalidInput("mesh: a vertex position is not finite");
  if (mesh.F.size() > 0 && (mesh.F.minCoeff() < 0 || mesh.F.maxCoeff() >= n))
    throw InvalidInput("mesh: a triangle refers to a vertex outside 0.." + std::to_string(n - 1));
  if (mesh.colours.rows() != 0 && mesh.colours.rows() != n)
    throw InvalidInput("mesh: " + std::to_string(mesh.colours.rows()) + " colours for " + std::to_string(n) +
                       " vertices");
  if (mesh.uv_faces.rows() != 0) {
    if (mesh.uv_faces.rows() != mesh.F.rows()) throw InvalidInput("mesh: texture triangles do not match the triangles");
    if (mesh.uv_faces.minCoeff() < 0 || mesh.uv_faces.maxCoeff() >= mesh.uv.rows())
      throw InvalidInput("mesh: a texture triangle refers to a coordinate that does not exist");
  } else if (mesh.uv.rows() != 0 && mesh.uv.rows() != n) {
    throw InvalidInput("mesh: texture coordinates do not match the vertices");
  }
}

}  // namespace facewright
