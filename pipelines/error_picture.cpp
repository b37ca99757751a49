// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/error_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/core/similarity.h"
#include "libmodel/geometry/normals.h"
#include "libmodel/render/colour_maps.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/rasterizer.h"
#include "pipelines/picture_text.h"

namespace facewright {
namespace {

constexpr double kViewAspect = 0.85;  // width over height of one view
constexpr double kFooterShare = 0.15;
constexpr Rgb kInk = {40, 40, 44};
constexpr double kGrey = 0.40, kStroke = 0.16;  // linear, of what has no match
constexpr int kHatchPeriod = 6, kHatchWidth = 2;

// Whether pixel (x, y) lies on a hatching stroke of a vertex of this origin.
bool on_stroke(MatchOrigin origin, int x, int y) {
  const bool rising = (x + y) % kHatchPeriod < kHatchWidth;
  const bool falling = (x - y + 100 * 1024 * kHatchPeriod) % kHatchPeriod < kHatchWidth;
  return (origin != MatchOrigin::interpolated && rising) || (origin != MatchOrigin::mirrored && falling);
}

// What a view is painted from.
struct Painted {
  Mesh mesh;  // head frame, colours by distance
  Vertices normals;
  const std::vector<MatchOrigin>& origins;
};

// Colours as a lamp beside the camera shows them; grey where there is no match.
Colours lit_colours(const Painted& p, const Eigen::Vector3d& towards) {
  const Eigen::VectorXd light = 0.45 + 0.55 * (p.normals * towards).array().max(0);
  Colours lit = light.asDiagonal() * p.mesh.colours;
  for (Eigen::Index i = 0; i < lit.rows(); ++i)
    if (p.origins[static_cast<size_t>(i)] != MatchOrigin::matched) lit.row(i).setConstant(kGrey * light[i]);
  return lit;
}

Eigen::RowVector3d sample_colour(const Painted& p, const Colours& lit, int f, const std::array<float, 3>& b, int x,
                                 int y) {
  const size_t largest = static_cast<size_t>(std::max_element(b.begin(), b.end()) - b.begin());
  const int nearest = p.mesh.F(f, static_cast<int>(largest));
  const MatchOrigin origin = p.origins[static_cast<size_t>(nearest)];
  if (origin != MatchOrigin::matched)
    return on_stroke(origin, x, y) ? Eigen::RowVector3d::Constant(kStroke).eval() : lit.row(nearest).eval();
  return b[0] * lit.row(p.mesh.F(f, 0)) + b[1] * lit.row(p.mesh.F(f, 1)) + b[2] * lit.row(p.mesh.F(f, 2));
}

Image paint_view(const Painted& p, int width, int height, double yaw) {
  constexpr int n = 2;  // samples per pixel, each way
  OrthographicCamera camera = frame_camera(p.mesh.V, n * width, n * height, yaw);
  const AffineCamera fine = camera.affine();
  const Colours lit = lit_colours(p, fine.towards_camera());
  const Raster raster = rasterize(p.mesh.V, p.mesh.F, fine, {n * width, n * height, true});
  Image image(width, height, 3, 255);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      int covered = 0;
      for (int k = 0; k < n * n; ++k) {
        const size_t at = raster.index(n * x + k % n, n * y + k / n);
        if (raster.triangle[at] < 0) continue;
        sum += sample_colour(p, lit, raster.triangle[at], raster.barycentric[at], x, y);
        ++covered;
      }
      if (covered == 0) continue;
      sum.array() += n * n - covered;  // white behind
      for (int k = 0; k < 3; ++k) image.pixel(x, y)[k] = srgb8_from_linear(sum[k] / (n * n));
    }
  return image;
}

std::string number(const char* format, double value) {
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

void paint_box(Image& image, int left, int top, int width, int height, const auto& colour_at) {
  for (int y = top; y < std::min(top + height, image.height); ++y)
    for (int x = left; x < std::min(left + width, image.width); ++x) {
      const Eigen::Vector3d c = colour_at(x, y);
      for (int k = 0; k < 3; ++k) image.pixel(x, y)[k] = srgb8_from_linear(c[k]);
    }
}

// Bar with five numbers, its ends and middle at left + 0, 1/4, ... of its width.
void paint_bar(Image& image, int left, int top, int width, int height, int dot, double range) {
  const Colours ramp = diverging_colours(Eigen::VectorXd::LinSpaced(width, -range, range), range);
  paint_box(image, left, top, width, height, [&](int x, int) { return ramp.row(x - left).transpose().eval(); });
  for (int i = 0; i <= 4; ++i) {
    const double value = range * (i - 2) / 2;
    const std::string text = number(i == 2 ? "%.0f" : "%+.3g", value) + (i == 4 ? " mm" : "");
    const int x = left + width * i / 4;
    paint_box(image, x - (i == 4), top + height, 1, 2 * dot,
              [](int, int) { return Eigen::Vector3d::Constant(0.02).eval(); });
    const int half = text_width(i == 4 ? text.substr(0, text.size() - 3) : text, dot) / 2;
    draw_text(image, {x - half, top + height + 3 * dot}, text, kInk, dot);
  }
}

void paint_legend(Image& image, int left, int top, int dot) {
  const std::pair<MatchOrigin, const char*> entries[] = {
      {MatchOrigin::mirrored, "mirrored"}, {MatchOrigin::interpolated, "interpolated"}, {MatchOrigin::free, "free"}};
  for (const auto& [origin, name] : entries) {
    const MatchOrigin o = origin;
    paint_box(image, left, top, 12 * dot, 8 * dot,
              [o](int x, int y) { return Eigen::Vector3d::Constant(on_stroke(o, x, y) ? kStroke : kGrey).eval(); });
    draw_text(image, {left + 14 * dot, top + dot / 2}, name, kInk, dot);
    left += 14 * dot + text_width(name, dot) + 5 * dot;
  }
}

void paint_footer(Image& image, int top, const RegisterSummary& s, double range) {
  const int dot = std::max(1, image.height / 200), margin = 16 * dot, bar = image.width * 36 / 100;
  paint_bar(image, margin, top + 5 * dot, bar, 10 * dot, dot, range);
  const int left = margin + bar + 36 * dot;
  draw_text(image, {left, top + 5 * dot},
            "mean " + number("%.3f", s.surface_mean) + ", 95 % " + number("%.3f", s.surface_p95) + " mm, folds " +
                std::to_string(s.folds),
            kInk, dot);
  paint_legend(image, left, top + 18 * dot, dot);
}

void check(const RegistrationResult& r, const MultiresTemplate& reference, const ErrorPictureOptions& o) {
  const auto N = static_cast<size_t>(reference.V.rows());
  if (reference.levels.empty() || static_cast<size_t>(r.V.rows()) != N || r.origins.size() != N ||
      r.nearest.size() != N)
    throw InvalidInput("error picture: the registration has " + std::to_string(r.V.rows()) +
                       " vertices, the reference " + std::to_string(N) + ", nearest points are given for " +
                       std::to_string(r.nearest.size()));
  if (!(o.range > 0) || o.height < 100 || o.height > 4000 || !(o.side >= 0 && o.side <= 90))
    throw InvalidInput("error picture: range > 0 mm, height 100..4000 pixels and side 0..90 degrees are required");
}

}  // namespace

Eigen::VectorXd signed_distances(const Vertices& points, const Mesh& surface,
                                 const std::vector<NearestPoint>& nearest) {
  if (nearest.size() != static_cast<size_t>(points.rows()))
    throw InvalidInput("signed distances: expected one nearest point per query");
  const Vertices normals = vertex_normals(surface.V, surface.F);
  Eigen::VectorXd d(points.rows());
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const NearestPoint& p = nearest[static_cast<size_t>(i)];
    const Eigen::Vector3d n = position(p.where, normals, surface.F);
    const double side = n.dot(points.row(i).transpose() - p.position);
    d[i] = side < 0 ? -p.distance : p.distance;
  }
  return d;
}

Image error_picture(const RegistrationResult& result, const MultiresTemplate& reference,
                    const ErrorPictureOptions& options) {
  check(result, reference, options);
  const Similarity head_from_scan = fit_similarity(result.V, reference.V);
  Painted p{{}, {}, result.origins};
  p.mesh.V = head_from_scan.apply(result.V);
  p.mesh.F = reference.levels.back().F;
  p.mesh.colours = diverging_colours(signed_distances(result.V, result.denoised, result.nearest), options.range);
  p.normals = vertex_normals(p.mesh.V, p.mesh.F);
  const int height = options.height, width = static_cast<int>(kViewAspect * height);
  const double side = options.side * std::numbers::pi / 180;
  const Image views = contact_sheet(
      {paint_view(p, width, height, -side), paint_view(p, width, height, 0), paint_view(p, width, height, side)}, 3);
  Image picture(views.width, height + static_cast<int>(kFooterShare * height), 3, 255);
  std::copy(views.data.begin(), views.data.end(), picture.data.begin());
  paint_footer(picture, height, result.summary, options.range);
  return picture;
}

}  // namespace facewright
