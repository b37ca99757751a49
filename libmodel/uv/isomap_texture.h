// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/multires_template.h"
#include "libmodel/uv/isomap.h"

namespace facewright {

struct IsomapTexture {
  TexCoords uv;                          ///< (N x 2) of the finest level; every level uses its first rows
  IsomapSummary base;                    ///< of the base level
  std::vector<UvDistortion> distortion;  ///< per template level
};

/// Texture coordinates of a whole hierarchy: isomap_uv on the base level of `mean` (N x 3), carried up by subdivision.
/// Bisection is linear in the plane, so it adds no flips, and a vertex has the same coordinates at every level.
IsomapTexture isomap_texture(const MultiresTemplate& reference, const Vertices& mean,
                             const IsomapOptions& options = {});

}  // namespace facewright
