// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/image.h"
#include "libmodel/render/simd4.h"

namespace facewright {

/// A square texture in floats: three values per texel, times a weight from 0 to 1, and the weight.
struct TextureLayer {
  int size = 0;
  std::vector<Float4> texels;

  explicit TextureLayer(int n = 0) : size(n), texels(static_cast<size_t>(n) * static_cast<size_t>(n), Float4{}) {}
  Float4& at(int x, int y) {
    return texels[static_cast<size_t>(y) * static_cast<size_t>(size) + static_cast<size_t>(x)];
  }
  const Float4& at(int x, int y) const {
    return texels[static_cast<size_t>(y) * static_cast<size_t>(size) + static_cast<size_t>(x)];
  }
};

/// Fills texels of low weight smoothly from their surroundings, near ones first, by pull and push over halved copies
/// [gortler1996]; every weight is then 1 (0 where the layer is empty). O(texels).
TextureLayer filled(TextureLayer layer);

/// The layer of half the size, with sums of its texels; weights above 1 are brought back to 1.
TextureLayer pulled(const TextureLayer& fine);
/// Value of a coarse layer at texel (x, y) of a layer `factor` times as fine, bilinear; the border is repeated.
Float4 interpolated(const TextureLayer& coarse, int x, int y, int factor);

/// Linear RGB times alpha, from an RGBA image that is square.
TextureLayer decoded(const Image& isomap);
/// The sRGB image of a layer of weight 1.
Image encoded_rgb(const TextureLayer& layer);

}  // namespace facewright
