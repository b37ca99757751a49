// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/projection.h"

namespace facewright {

ProjectedVertices project_vertices(const Vertices& V, const AffineCamera& camera) {
  ProjectedVertices p;
  p.pixels = (V * camera.A.transpose()).rowwise() + camera.b.transpose();
  p.depth = V * camera.towards_camera();
  return p;
}

}  // namespace facewright
