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
  std::vector<double> overlap;           ///< per template level: overlap_share of 2048 x 2048 pixels
};

/// Texture coordinates of a whole hierarchy: isomap_uv on the base level of `mean` (N x 3), carried up by subdivision.
/// Bisection is linear in the plane, so it adds no flips, and a vertex has the same coordinates at every level.
IsomapTexture isomap_texture(const MultiresTemplate& reference, const Vertices& mean,
                             const IsomapOptions& options = {});

/// The base level's part of that work, the slow one: isomap_uv on the first rows of `mean`.
IsomapResult base_isomap(const MultiresTemplate& reference, const Vertices& mean, const IsomapOptions& options = {});
/// The rest of it: `base` carried up, and measured at every level.
IsomapTexture texture_from_base(const MultiresTemplate& reference, const Vertices& mean, const IsomapResult& base);

}  // namespace facewright
