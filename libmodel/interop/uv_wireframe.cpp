// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/uv_wireframe.h"

#include <algorithm>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"

namespace facewright {
namespace {

constexpr double kHalfWidth = 0.4;  // pixels
constexpr double kDarkness = 200;   // of 255, so that crossings stay visible

// Darkens the pixels within reach of the segment by their distance to it.
void draw_segment(Image& image, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d d = b - a;
  const double length = d.squaredNorm(), reach = kHalfWidth + 1;
  const auto clamped = [](double x, int n) { return std::clamp(static_cast<int>(x), 0, n - 1); };
  const int x0 = clamped(std::min(a.x(), b.x()) - reach, image.width);
  const int x1 = clamped(std::max(a.x(), b.x()) + reach + 1, image.width);
  const int y0 = clamped(std::min(a.y(), b.y()) - reach, image.height);
  const int y1 = clamped(std::max(a.y(), b.y()) + reach + 1, image.height);
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const Eigen::Vector2d p(x, y);
      const double t = length > 0 ? std::clamp((p - a).dot(d) / length, 0.0, 1.0) : 0;
      const double cover = std::clamp(kHalfWidth + 0.5 - (p - a - t * d).norm(), 0.0, 1.0);
      auto& value = *image.pixel(x, y);
      value = std::min(value, static_cast<std::uint8_t>(255 - kDarkness * cover));
    }
}

}  // namespace

Image uv_wireframe(const TexCoords& uv, const Faces& F, int size) {
  if (size < 1 || (F.size() > 0 && F.maxCoeff() >= uv.rows()))
    throw InvalidInput("wireframe: needs one texture coordinate per vertex and a size above 0");
  Image image(size, size, 1, 255);
  const auto pixel = [&](int v) { return Eigen::Vector2d(uv(v, 0) * size - 0.5, (1 - uv(v, 1)) * size - 0.5); };
  for (const Edge& e : edges(F)) draw_segment(image, pixel(e.v0), pixel(e.v1));
  return image;
}

}  // namespace facewright
