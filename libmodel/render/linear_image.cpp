// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/linear_image.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

std::array<float, 256> decoding_table() {
  std::array<float, 256> table{};
  for (int i = 0; i < 256; ++i)
    table[static_cast<size_t>(i)] = static_cast<float>(linear_from_srgb8(static_cast<std::uint8_t>(i)));
  return table;
}

/// Returns whether all of it is opaque.
bool decode_row(const Image& image, int left, int y, int count, float* out) {
  static const std::array<float, 256> table = decoding_table();
  const float* decode = table.data();
  const std::uint8_t* in = image.pixel(left, y);
  const int channels = image.channels, step = channels >= 3 ? 1 : 0;
  unsigned least = 255;
  if (channels == 4) {
    for (int x = 0; x < count; ++x, in += 4, out += 4) {
      least = std::min<unsigned>(least, in[3]);
      const float alpha = static_cast<float>(in[3]) / 255.0F;
      out[0] = alpha * decode[in[0]], out[1] = alpha * decode[in[1]], out[2] = alpha * decode[in[2]], out[3] = alpha;
    }
  } else {
    for (int x = 0; x < count; ++x, in += channels, out += 4)
      out[0] = decode[in[0]], out[1] = decode[in[step]], out[2] = decode[in[2 * step]], out[3] = 1;
  }
  return least == 255;
}

}  // namespace

void LinearImage::repeat_borders(Level& level) {
  const size_t row = 4 * static_cast<size_t>(level.stride);
  for (int y = 0; y < level.height; ++y) {
    float* end = level.texels.data() + static_cast<size_t>(y) * row + 4 * static_cast<size_t>(level.width);
    std::memcpy(end, end - 4, 4 * sizeof(float));
  }
  float* last = level.texels.data() + static_cast<size_t>(level.height) * row;
  std::memcpy(last, last - row, row * sizeof(float));
  level.x_limit = static_cast<float>(level.width - 1), level.y_limit = static_cast<float>(level.height - 1);
}

LinearImage::Level LinearImage::halved(const Level& fine) {
  Level level;
  level.width = (fine.width + 1) / 2, level.height = (fine.height + 1) / 2, level.stride = level.width + 1;
  level.scale = fine.scale / 2, level.shift = fine.shift / 2 - 0.25F;
  level.texels = LargeBuffer(4 * static_cast<size_t>(level.stride) * static_cast<size_t>(level.height + 1));
  const size_t row = 4 * static_cast<size_t>(fine.stride);
  for (int y = 0; y < level.height; ++y) {  // an odd size reads its repeated border
    const float* p = fine.texels.data() + 2 * static_cast<size_t>(y) * row;
    float* out = level.texels.data() + 4 * static_cast<size_t>(y) * static_cast<size_t>(level.stride);
    for (int x = 0; x < level.width; ++x, p += 8, out += 4)
      Eigen::Map<Rgba>{out} = 0.25F * ((at(p) + at(p + 4)) + (at(p + row) + at(p + row + 4)));
  }
  repeat_borders(level);
  return level;
}

LinearImage::LinearImage(const Image& image, int levels, int left, int top, int right, int bottom) {
  if (image.empty() || image.width < 1 || image.height < 1) throw InvalidInput("image: it is empty");
  left = std::clamp(left, 0, image.width - 1), right = std::clamp(right, left + 1, image.width);
  top = std::clamp(top, 0, image.height - 1), bottom = std::clamp(bottom, top + 1, image.height);
  left_ = static_cast<float>(left), top_ = static_cast<float>(top);
  Level base;
  base.width = right - left, base.height = bottom - top, base.stride = base.width + 1;
  base.texels = LargeBuffer(4 * static_cast<size_t>(base.stride) * static_cast<size_t>(base.height + 1));
  for (int y = 0; y < base.height; ++y)
    opaque_ &= decode_row(image, left, top + y, base.width,
                          base.texels.data() + 4 * static_cast<size_t>(y) * static_cast<size_t>(base.stride));
  repeat_borders(base);
  levels_.push_back(std::move(base));
  while (static_cast<int>(levels_.size()) < levels && std::max(levels_.back().width, levels_.back().height) > 1)
    levels_.push_back(halved(levels_.back()));
}

}  // namespace facewright
