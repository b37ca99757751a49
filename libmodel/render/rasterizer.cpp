// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/rasterizer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

/// Twice the signed area of (a, b, p). Always computed from the smaller to the larger end point, so that the two
/// triangles at an edge get exactly opposite values.
class EdgeFunction {
 public:
  EdgeFunction(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const bool swapped = b[0] < a[0] || (b[0] == a[0] && b[1] < a[1]);
    origin_ = swapped ? b : a;
    const Eigen::Vector2d d = swapped ? Eigen::Vector2d(a - b) : Eigen::Vector2d(b - a);
    direction_ = d;
    sign_ = swapped ? -1 : 1;
    // Positive inside: y runs down, so a top edge points right and a left edge points up.
    const Eigen::Vector2d e = sign_ * d;
    owns_ = (e[1] == 0 && e[0] > 0) || e[1] < 0;
  }
  double operator()(double x, double y) const {
    return sign_ * (direction_[0] * (y - origin_[1]) - direction_[1] * (x - origin_[0]));
  }
  bool contains(double value) const { return value > 0 || (value == 0 && owns_); }

 private:
  Eigen::Vector2d origin_, direction_;
  double sign_ = 1;
  bool owns_ = false;
};

/// Clamped before the conversion: far corners do not overflow.
int first_pixel(double x, int size) { return static_cast<int>(std::ceil(std::clamp<double>(x, 0, size))); }
int last_pixel(double x, int size) { return static_cast<int>(std::floor(std::clamp<double>(x, -1, size - 1))); }

/// Draws one triangle with corners c and depths z, of either orientation.
void draw(Raster& raster, int id, std::array<Eigen::Vector2d, 3> c, const std::array<double, 3>& z) {
  double area = EdgeFunction(c[0], c[1])(c[2][0], c[2][1]);
  if (!(std::abs(area) > 0) || !std::isfinite(area)) return;
  std::array<size_t, 3> order = {0, 1, 2};
  if (area < 0) std::swap(order[1], order[2]), area = -area;
  const auto corner = [&](size_t k) -> const Eigen::Vector2d& { return c[order[k % 3]]; };
  const std::array<EdgeFunction, 3> edge = {EdgeFunction(corner(1), corner(2)), EdgeFunction(corner(2), corner(0)),
                                            EdgeFunction(corner(0), corner(1))};
  const auto [x_low, x_high] = std::minmax({c[0][0], c[1][0], c[2][0]});
  const auto [y_low, y_high] = std::minmax({c[0][1], c[1][1], c[2][1]});
  for (int y = first_pixel(y_low, raster.height); y <= last_pixel(y_high, raster.height); ++y)
    for (int x = first_pixel(x_low, raster.width); x <= last_pixel(x_high, raster.width); ++x) {
      const std::array<double, 3> e = {edge[0](x, y), edge[1](x, y), edge[2](x, y)};
      if (!edge[0].contains(e[0]) || !edge[1].contains(e[1]) || !edge[2].contains(e[2])) continue;
      const double total = e[0] + e[1] + e[2];
      std::array<double, 3> b{};
      for (size_t k = 0; k < 3; ++k) b[order[k]] = e[k] / total;
      const auto depth = static_cast<float>(b[0] * z[0] + b[1] * z[1] + b[2] * z[2]);
      const size_t at = raster.index(x, y);
      if (raster.triangle[at] >= 0 && !(depth > raster.depth[at])) continue;
      raster.triangle[at] = id;
      raster.depth[at] = depth;
      raster.barycentric[at] = {static_cast<float>(b[0]), static_cast<float>(b[1]), static_cast<float>(b[2])};
    }
}

Raster empty_raster(int width, int height) {
  if (width <= 0 || height <= 0 || width > 32768 || height > 32768)
    throw InvalidInput("raster: expected a size of 1..32768 pixels, got " + std::to_string(width) + " x " +
                       std::to_string(height));
  Raster raster;
  raster.width = width;
  raster.height = height;
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  raster.triangle.assign(pixels, -1);
  raster.depth.assign(pixels, -std::numeric_limits<float>::infinity());
  raster.barycentric.assign(pixels, {0, 0, 0});
  return raster;
}

void check_indices(const Faces& F, Eigen::Index rows) {
  if (F.size() > 0 && (F.minCoeff() < 0 || F.maxCoeff() >= rows))
    throw InvalidInput("raster: a triangle refers to a vertex outside 0.." + std::to_string(rows - 1));
}

}  // namespace

Raster rasterize(const Vertices& V, const Faces& F, const AffineCamera& camera, const RasterOptions& options) {
  Raster raster = empty_raster(options.width, options.height);
  check_indices(F, V.rows());
  const TexCoords pixels = (V * camera.A.transpose()).rowwise() + camera.b.transpose();
  const Eigen::VectorXd depth = V * camera.towards_camera();
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    std::array<Eigen::Vector2d, 3> c;
    std::array<double, 3> z{};
    for (int k = 0; k < 3; ++k) c[k] = pixels.row(F(f, k)), z[k] = depth[F(f, k)];
    // Counter-clockwise from outside is clockwise in pixels, because y runs down.
    const Eigen::Vector2d u = c[1] - c[0], v = c[2] - c[0];
    if (options.cull_backfaces && u[0] * v[1] - u[1] * v[0] >= 0) continue;
    draw(raster, static_cast<int>(f), c, z);
  }
  return raster;
}

Raster rasterize_flat(const TexCoords& pixels, const Faces& F, int width, int height) {
  Raster raster = empty_raster(width, height);
  check_indices(F, pixels.rows());
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    draw(raster, static_cast<int>(f), {pixels.row(F(f, 0)), pixels.row(F(f, 1)), pixels.row(F(f, 2))}, {0, 0, 0});
  return raster;
}

}  // namespace facewright
