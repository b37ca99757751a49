// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

#include "libmodel/core/camera.h"
#include "libmodel/core/mesh.h"

namespace facewright {

/// Vertices on the screen, all that the rasteriser knows of a camera.
struct ProjectedVertices {
  TexCoords pixels;           ///< (N x 2) x right, y down; not finite: cannot be seen, its triangles are left out
  Eigen::VectorXd depth;      ///< (N) mm, larger is nearer: x . towards_camera() or, in perspective, -w
  Eigen::VectorXd inverse_w;  ///< (N) 1 / w, w > 0 the distance along the optical axis in mm; empty: affine

  bool perspective() const { return inverse_w.size() > 0; }
};

ProjectedVertices project_vertices(const Vertices& V, const AffineCamera& camera);
/// Vertices nearer than a millimetre, or behind the camera, cannot be seen.
ProjectedVertices project_vertices(const Vertices& V, const PerspectiveCamera& camera);

}  // namespace facewright
