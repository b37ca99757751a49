// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/core/similarity.h"

namespace facewright {

/// The 24 rotations of a cube.
std::vector<Eigen::Matrix3d> cube_rotations();

/// Axes of a point set by its second moments, the longest first, right-handed.
Eigen::Matrix3d principal_axes(const Vertices& points);

/// Rough places of a face that looks along the third column of `scan_from_head`, one every 25 mm from the top to the
/// bottom: `nose` (head frame) on the foremost surface. For surfaces whose nose is missing.
std::vector<Similarity> swept_poses(const Vertices& points, const Vertices& normals,
                                    const Eigen::Matrix3d& scan_from_head, const Eigen::Vector3d& nose);

}  // namespace facewright
