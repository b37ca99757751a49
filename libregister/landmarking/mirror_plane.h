// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/mesh.h"
#include "libmodel/surface/nearest.h"

namespace facewright {

/// A plane n.x = offset, n of unit length.
struct MirrorPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();
  double offset = 0;
  double residual = 0;  ///< mm: rms distance of the trimmed points' mirror images from the surface's tangent planes

  Eigen::Vector3d reflect(const Eigen::Vector3d& x) const { return x - 2 * (normal.dot(x) - offset) * normal; }
};

struct MirrorPlaneOptions {
  double trimmed = 0.7;  ///< share of the points that counts: those whose mirror images lie nearest
  int iterations = 30;
};

/// The plane in which a surface is most nearly its own mirror image, from a first guess: point-to-plane iterations of
/// the points `sample` against the whole surface (points with normals, index over the points), in the plane's own three
/// parameters; the worst points are trimmed off. After [benz2002].
MirrorPlane refine_mirror_plane(const MirrorPlane& guess, const Vertices& points, const Vertices& normals,
                                const PointIndex& index, const std::vector<int>& sample,
                                const MirrorPlaneOptions& options = {});

}  // namespace facewright
