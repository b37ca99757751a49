// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>

#include "libmodel/uv/isomap_texture.h"

namespace facewright {

struct TextureStage {
  IsomapTexture texture;
  bool reused = false;  ///< the flattening was found in the file
};

/// isomap_texture that leaves its figures and the base level's coordinates in `file` (JSON), and takes the coordinates
/// from there if an earlier run flattened the same: SHA-256 of the base level's positions, triangles and symmetry, the
/// options, and the version of the method. The same bytes either way; a file that does not fit is written anew.
TextureStage texture_stage(const MultiresTemplate& reference, const Vertices& mean, const std::filesystem::path& file,
                           const IsomapOptions& options = {});

}  // namespace facewright
