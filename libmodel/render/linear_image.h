// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "libmodel/core/image.h"
#include "libmodel/render/large_buffer.h"
#include "libmodel/render/simd4.h"

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

  /// One level, by value, for inner loops.
  class Sampler {
   public:
    /// Bilinear sample at a pixel position (x, y) of the image.
    Float4 operator()(float x, float y) const {
      const float px = clamp(x * scale + left, x_limit), py = clamp(y * scale + top, y_limit);
      const int i = static_cast<int>(px), j = static_cast<int>(py);
      const float* p = texels + 4 * (static_cast<ptrdiff_t>(j) * stride + i);
      const float* q = p + 4 * static_cast<ptrdiff_t>(stride);
      const Float4 fx = broadcast4(px - static_cast<float>(i)), fy = broadcast4(py - static_cast<float>(j));
      const Float4 a = load4<Float4>(p), b = load4<Float4>(q);
      const Float4 upper = a + fx * (load4<Float4>(p + 4) - a), lower = b + fx * (load4<Float4>(q + 4) - b);
      return upper + fy * (lower - upper);
    }

   private:
    friend class LinearImage;
    static float clamp(float x, float limit) {
      const float positive = x > 0 ? x : 0;  // NaN becomes 0
      return positive < limit ? positive : limit;
    }
    const float* texels = nullptr;
    int stride = 0;
    float left = 0, top = 0, scale = 1, x_limit = 0, y_limit = 0;
  };
  Sampler sampler(int level) const {
    const Level& from = levels_[static_cast<size_t>(level)];
    Sampler s;
    s.texels = from.texels.data(), s.stride = from.stride;
    s.scale = from.scale, s.left = from.shift - from.scale * left_, s.top = from.shift - from.scale * top_;
    s.x_limit = from.x_limit, s.y_limit = from.y_limit;
    return s;
  }

  Rgba sample(float x, float y, int level = 0) const {
    const Float4 v = sampler(level)(x, y);
    return Rgba(v[0], v[1], v[2], v[3]);
  }
  /// Between two levels, `lod` = log2 of the pixels per sample; 0 and less is the image itself.
  Float4 trilinear(float x, float y, float lod) const {
    const float top = static_cast<float>(levels() - 1);
    if (!(lod > 0) || top == 0) return sampler(0)(x, y);
    if (lod >= top) return sampler(levels() - 1)(x, y);
    const int level = static_cast<int>(lod);
    const Float4 fine = sampler(level)(x, y), coarse = sampler(level + 1)(x, y);
    return fine + broadcast4(lod - static_cast<float>(level)) * (coarse - fine);
  }

 private:
  struct Level {
    int width = 0, height = 0, stride = 0;  ///< one more column and row than the image, repeating its last
    float scale = 1, shift = 0, x_limit = 0, y_limit = 0;
    LargeBuffer texels;
  };
  static Rgba at(const float* p) { return Eigen::Map<const Rgba>(p); }
  static Level halved(const Level& fine);
  static void repeat_borders(Level& level);

  float left_ = 0, top_ = 0;
  bool opaque_ = true;
  std::vector<Level> levels_;
};

}  // namespace facewright
