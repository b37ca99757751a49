// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/overlays.h"

#include <algorithm>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/render/rasterizer.h"

namespace facewright {
namespace {

void blend(Image& image, int x, int y, const Rgb& colour, double opacity) {
  std::uint8_t* out = image.pixel(x, y);
  const double a = std::clamp(opacity, 0.0, 1.0);
  for (size_t k = 0; k < 3; ++k) out[k] = static_cast<std::uint8_t>(std::lround((1 - a) * out[k] + a * colour[k]));
  if (image.channels == 4) out[3] = static_cast<std::uint8_t>(std::max<long>(out[3], std::lround(255 * a)));
}

/// Blends every pixel of a box by coverage(x, y).
template <typename Coverage>
void fill_box(Image& image, Eigen::Vector2d low, Eigen::Vector2d high, const Rgb& colour, const Coverage& coverage) {
  if (image.channels < 3) throw InvalidInput("overlay: expected an image of 3 or 4 channels");
  if (!low.allFinite() || !high.allFinite()) return;
  low = low.cwiseMax(0), high = high.cwiseMin(Eigen::Vector2d(image.width - 1, image.height - 1));
  if (low[0] > high[0] || low[1] > high[1]) return;
  for (int y = static_cast<int>(std::floor(low[1])); y <= static_cast<int>(std::ceil(high[1])); ++y)
    for (int x = static_cast<int>(std::floor(low[0])); x <= static_cast<int>(std::ceil(high[0])); ++x) {
      const double c = x < image.width && y < image.height ? coverage(Eigen::Vector2d(x, y)) : 0;
      if (c > 0) blend(image, x, y, colour, c);
    }
}

template <typename Camera>
void blend_wireframe(Image& image, const Vertices& V, const Faces& F, const Camera& camera, const Rgb& colour,
                     double opacity) {
  if (image.channels < 3) throw InvalidInput("overlay: expected an image of 3 or 4 channels");
  const Raster raster = rasterize(project_vertices(V, camera), F, {image.width, image.height, true});
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const size_t at = raster.index(x, y);
      const int f = raster.triangle[at];
      if (f < 0) continue;
      std::array<Eigen::Vector2d, 3> p;
      for (int k = 0; k < 3; ++k) p[static_cast<size_t>(k)] = camera.project(V.row(F(f, k)).transpose());
      const Eigen::Vector2d u = p[1] - p[0], v = p[2] - p[0];
      const double area2 = std::abs(u[0] * v[1] - u[1] * v[0]);
      double distance = 1e9;  // to the nearest edge: barycentric coordinate times height
      for (size_t k = 0; k < 3; ++k)
        distance = std::min(distance, static_cast<double>(raster.barycentric[at][k]) * area2 /
                                          std::max((p[(k + 1) % 3] - p[(k + 2) % 3]).norm(), 1e-9));
      const double coverage = std::clamp(1 - distance, 0.0, 1.0);
      if (coverage > 0) blend(image, x, y, colour, opacity * coverage);
    }
}

}  // namespace

void draw_disc(Image& image, const Eigen::Vector2d& centre, double radius, const Rgb& colour, double opacity) {
  const Eigen::Vector2d reach = Eigen::Vector2d::Constant(radius + 1);
  fill_box(image, centre - reach, centre + reach, colour, [&](const Eigen::Vector2d& p) {
    return opacity * std::clamp(radius + 0.5 - (p - centre).norm(), 0.0, 1.0);
  });
}

void draw_line(Image& image, const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Rgb& colour, double width,
               double opacity) {
  const Eigen::Vector2d reach = Eigen::Vector2d::Constant(width / 2 + 1), d = b - a;
  const double length2 = std::max(d.squaredNorm(), 1e-12);
  fill_box(image, a.cwiseMin(b) - reach, a.cwiseMax(b) + reach, colour, [&](const Eigen::Vector2d& p) {
    const double t = std::clamp((p - a).dot(d) / length2, 0.0, 1.0);
    return opacity * std::clamp(width / 2 + 0.5 - (p - a - t * d).norm(), 0.0, 1.0);
  });
}

void draw_cross(Image& image, const Eigen::Vector2d& centre, double radius, const Rgb& colour, double width) {
  const Eigen::Vector2d x(radius, 0), y(0, radius);
  draw_line(image, centre - x, centre + x, colour, width);
  draw_line(image, centre - y, centre + y, colour, width);
}

void draw_landmarks(Image& image, const ImageLandmarks& landmarks, double radius, const Rgb& colour) {
  for (const auto& [name, mark] : landmarks)
    draw_cross(image, mark.position, radius, colour, std::max(1.0, radius / 3));
}

void draw_wireframe(Image& image, const Vertices& V, const Faces& F, const AffineCamera& camera, const Rgb& colour,
                    double opacity) {
  blend_wireframe(image, V, F, camera, colour, opacity);
}

void draw_wireframe(Image& image, const Vertices& V, const Faces& F, const PerspectiveCamera& camera, const Rgb& colour,
                    double opacity) {
  blend_wireframe(image, V, F, camera, colour, opacity);
}

Image to_rgb(const Image& image) {
  Image out(image.width, image.height, 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int k = 0; k < 3; ++k) out.pixel(x, y)[k] = image.pixel(x, y)[image.channels < 3 ? 0 : k];
  return out;
}

}  // namespace facewright
