// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/texture_layer.h"

#include <algorithm>

#include "libmodel/render/srgb_encoder.h"

namespace facewright {

TextureLayer pulled(const TextureLayer& fine) {
  TextureLayer coarse((fine.size + 1) / 2);
  for (int y = 0; y < fine.size; ++y)
    for (int x = 0; x < fine.size; ++x) coarse.at(x / 2, y / 2) += fine.at(x, y);
  for (Float4& t : coarse.texels)
    if (t[3] > 1) t /= broadcast4(t[3]);
  return coarse;
}

Float4 interpolated(const TextureLayer& coarse, int x, int y, int factor) {
  const auto limit = static_cast<float>(coarse.size - 1);
  const auto place = [&](int i) {
    return std::clamp((static_cast<float>(i) + 0.5F) / static_cast<float>(factor) - 0.5F, 0.0F, limit);
  };
  const float px = place(x), py = place(y);
  const int i = static_cast<int>(px), j = static_cast<int>(py);
  const int right = std::min(i + 1, coarse.size - 1), below = std::min(j + 1, coarse.size - 1);
  const Float4 fx = broadcast4(px - static_cast<float>(i)), fy = broadcast4(py - static_cast<float>(j));
  const Float4 upper = coarse.at(i, j) + fx * (coarse.at(right, j) - coarse.at(i, j));
  const Float4 lower = coarse.at(i, below) + fx * (coarse.at(right, below) - coarse.at(i, below));
  return upper + fy * (lower - upper);
}

TextureLayer filled(TextureLayer layer) {
  if (layer.size <= 1) {
    for (Float4& t : layer.texels)
      if (t[3] > 0) t /= broadcast4(t[3]);
    return layer;
  }
  const TextureLayer coarse = filled(pulled(layer));
  for (int y = 0; y < layer.size; ++y)
    for (int x = 0; x < layer.size; ++x) {
      Float4& t = layer.at(x, y);
      if (t[3] < 1) t += broadcast4(1 - t[3]) * interpolated(coarse, x, y, 2);
    }
  return layer;
}

TextureLayer decoded(const Image& isomap) {
  TextureLayer layer(isomap.width);
  for (int y = 0; y < layer.size; ++y)
    for (int x = 0; x < layer.size; ++x) {
      const std::uint8_t* p = isomap.pixel(x, y);
      const float alpha = static_cast<float>(p[3]) / 255.0F;
      for (int k = 0; k < 3; ++k) layer.at(x, y)[k] = alpha * static_cast<float>(linear_from_srgb8(p[k]));
      layer.at(x, y)[3] = alpha;
    }
  return layer;
}

Image encoded_rgb(const TextureLayer& layer) {
  Image image(layer.size, layer.size, 3);
  const SrgbEncoder& encode = SrgbEncoder::get();
  for (int y = 0; y < layer.size; ++y)
    for (int x = 0; x < layer.size; ++x) encode.write(layer.at(x, y), image.pixel(x, y));
  return image;
}

}  // namespace facewright
