// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <array>
#include <cstdio>
#include <limits>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/render/colour_maps.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/overlays.h"
#include "libmodel/render/render_mesh.h"
#include "pipelines/fit_images/fit_scan_files.h"
#include "pipelines/picture_text.h"

namespace facewright {
namespace {

constexpr int width = 340, height = 420, footer = 56, bar = 360;
constexpr Rgb ink = {40, 40, 44};

std::string number(double x) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%+.2g", x);
  return text.data();
}

std::uint8_t srgb_byte(double linear) {
  const double x = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(x, 0.0, 1.0)));
}

/// The colour bar with its ends and what they mean, in the lowest `footer` rows.
void draw_bar(Image& image, double range) {
  const int left = (image.width - bar) / 2, top = image.height - footer + 8;
  const Colours colours = diverging_colours(Eigen::VectorXd::LinSpaced(bar, -range, range), range);
  for (int x = 0; x < bar; ++x)
    for (int y = 0; y < 14; ++y)
      for (int k = 0; k < 3; ++k) image.pixel(left + x, top + y)[k] = srgb_byte(colours(x, k));
  const std::string low = number(-range), high = number(range), mean = "mm from the scan, + outside, grey: no match";
  draw_text(image, {left - text_width(low) - 8, top}, low, ink);
  draw_text(image, {left + bar + 8, top}, high, ink);
  draw_text(image, {(image.width - text_width(mean)) / 2, top + 22}, mean, ink);
}

}  // namespace

Image distance_picture(const Vertices& V, const Faces& F, const Eigen::VectorXd& distances,
                       const std::vector<ScanMatch>& matches, double range_mm) {
  Eigen::VectorXd shown = distances;
  for (size_t i = 0; i < matches.size(); ++i)
    if (matches[i] != ScanMatch::counts) shown[static_cast<Eigen::Index>(i)] = std::numeric_limits<double>::quiet_NaN();
  Mesh mesh;
  mesh.V = V, mesh.F = F;
  mesh.colours = diverging_colours(shown, range_mm);
  RenderOptions options;
  options.width = width, options.height = height;
  options.background.setOnes();
  std::vector<Image> views;
  for (const double yaw_deg : {50.0, 0.0, -50.0})
    views.push_back(render_mesh(mesh, frame_camera(mesh.V, width, height, yaw_deg * std::numbers::pi / 180), options));
  const Image sheet = contact_sheet(views, 3);
  Image out(sheet.width, sheet.height + footer, 3);
  std::fill(out.data.begin(), out.data.end(), std::uint8_t{255});
  std::copy(sheet.data.begin(), sheet.data.end(), out.data.begin());
  draw_bar(out, range_mm);
  return out;
}

}  // namespace facewright
