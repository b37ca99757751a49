// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/projection.h"

#include <limits>

namespace facewright {

ProjectedVertices project_vertices(const Vertices& V, const AffineCamera& camera) {
  ProjectedVertices p;
  p.pixels = (V * camera.A.transpose()).rowwise() + camera.b.transpose();
  p.depth = V * camera.towards_camera();
  return p;
}

ProjectedVertices project_vertices(const Vertices& V, const PerspectiveCamera& camera) {
  constexpr double nearest = 1, nowhere = std::numeric_limits<double>::quiet_NaN();
  ProjectedVertices p;
  p.pixels.resize(V.rows(), 2);
  p.depth.resize(V.rows()), p.inverse_w.resize(V.rows());
  for (Eigen::Index i = 0; i < V.rows(); ++i) {
    const Eigen::Vector3d q = camera.in_camera(V.row(i).transpose());
    const double w = -q[2], inverse = w > nearest ? 1 / w : nowhere;
    p.pixels(i, 0) = camera.principal[0] + camera.focal_px * inverse * q[0];
    p.pixels(i, 1) = camera.principal[1] - camera.focal_px * inverse * q[1];
    p.depth[i] = -w, p.inverse_w[i] = inverse;
  }
  return p;
}

}  // namespace facewright
