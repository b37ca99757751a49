// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <string>

#include "libmodel/core/mesh.h"

namespace facewright {

// Private to this module.

/// A mesh as a page takes it: little-endian, one after another: positions less `centre` (float32 x 3 N), triangles
/// (uint32 x 3 M), colours if any (uint8 x 3 N, sRGB), texture coordinates if any (float32 x 2 N). Vertices are
/// repeated where their texture coordinates differ from triangle to triangle.
struct ScanBytes {
  Eigen::Index vertices = 0, triangles = 0;
  bool has_colours = false, has_uv = false;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the bounding box
  std::string bytes;
};

ScanBytes scan_bytes(const Mesh& mesh);

}  // namespace facewright
