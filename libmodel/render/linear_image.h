// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/image.h"

namespace facewright {

/// Linear RGB times alpha, and alpha.
using Rgba = Eigen::Array4f;

/// An image, or a part of it, in linear light for fast filtered sampling: red, green and blue premultiplied by alpha as
/// floats, with smaller copies (mip maps), each the mean of 2 x 2 pixels of the one before.
/// Positions outside are clamped: nothing outside is ever read, whatever the position, NaN included.
class LinearImage {
 public:
  /// Columns [left, right) and rows [top, bottom) of the image, cut to it; `levels` copies at most, the first of them
  /// the image itself. Throws InvalidInput for an empty image. O(pixels).
  LinearImage(const Image& image, int levels, int left, int top, int right, int bottom);
  explicit LinearImage(const Image& image, int levels = 32)
      : LinearImage(image, levels, 0, 0, image.width, image.height) {}

  int levels() const { return static_cast<int>(levels_.size()); }
  int width() const { return levels_[0].width; }
  int height() const { return levels_[0].height; }
  bool opaque() const { return opaque_; }  ///< alpha is 1 everywhere

  /// Bilinear sample of one level at a pixel position (x, y) of the image.
  Rgba sample(float x, float y, int level = 0) const {
    const Level& from = levels_[static_cast<size_t>(level)];
    const float px = clamp((x - left_) * from.scale + from.shift, from.x_limit);
    const float py = clamp((y - top_) * from.scale + from.shift, from.y_limit);
    const int i = static_cast<int>(px), j = static_cast<int>(py);
    const float fx = px - static_cast<float>(i), fy = py - static_cast<float>(j);
    const float* p =
        from.texels.data() + 4 * (static_cast<size_t>(j) * static_cast<size_t>(from.stride) + static_cast<size_t>(i));
    const float* q = p + 4 * static_cast<size_t>(from.stride);
    const Rgba a = at(p), b = at(q);
    const Rgba upper = a + fx * (at(p + 4) - a), lower = b + fx * (at(q + 4) - b);
    return upper + fy * (lower - upper);
  }
  /// Between two levels, `lod` = log2 of the pixels per sample; 0 and less is the image itself.
  Rgba sample_trilinear(float x, float y, float lod) const {
    if (!(lod > 0) || levels() == 1) return sample(x, y);
    const float top = static_cast<float>(levels() - 1);
    if (lod >= top) return sample(x, y, levels() - 1);
    const int level = static_cast<int>(lod);
    const Rgba fine = sample(x, y, level), coarse = sample(x, y, level + 1);
    return fine + (lod - static_cast<float>(level)) * (coarse - fine);
  }

 private:
  struct Level {
    int width = 0, height = 0, stride = 0;  ///< one more column and row than the image, repeating its last
    float scale = 1, shift = 0, x_limit = 0, y_limit = 0;
    std::vector<float> texels;
  };
  static float clamp(float x, float limit) {
    const float positive = x > 0 ? x : 0;  // NaN becomes 0
    return positive < limit ? positive : limit;
  }
  static Rgba at(const float* p) { return Eigen::Map<const Rgba>(p); }
  static Level halved(const Level& fine);
  static void repeat_borders(Level& level);

  float left_ = 0, top_ = 0;
  bool opaque_ = true;
  std::vector<Level> levels_;
};

}  // namespace facewright
