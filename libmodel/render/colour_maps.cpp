// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/colour_maps.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/core/image.h"

namespace facewright {
namespace {

using Stops = std::array<std::array<double, 3>, 5>;  // sRGB, evenly spaced

Eigen::RowVector3d at(const Stops& stops, double t) {  // t in 0..1
  if (std::isnan(t)) return Eigen::RowVector3d::Constant(linear_from_srgb(0.5));
  const double x = std::clamp(t, 0.0, 1.0) * (stops.size() - 1);
  const auto i = std::min(static_cast<size_t>(x), stops.size() - 2);
  const double f = x - static_cast<double>(i);
  Eigen::RowVector3d rgb;
  for (int k = 0; k < 3; ++k)
    rgb[k] = linear_from_srgb((1 - f) * stops[i][static_cast<size_t>(k)] + f * stops[i + 1][static_cast<size_t>(k)]);
  return rgb;
}

void check(double range) {
  if (!(range > 0)) throw InvalidInput("colour map: expected a range > 0");
}

}  // namespace

Colours diverging_colours(const Eigen::VectorXd& values, double range) {
  check(range);
  static constexpr Stops stops = {
      {{0.10, 0.24, 0.60}, {0.47, 0.68, 0.88}, {0.96, 0.96, 0.95}, {0.93, 0.60, 0.46}, {0.66, 0.09, 0.15}}};
  Colours out(values.size(), 3);
  for (Eigen::Index i = 0; i < values.size(); ++i) out.row(i) = at(stops, 0.5 + 0.5 * values[i] / range);
  return out;
}

Colours sequential_colours(const Eigen::VectorXd& values, double range) {
  check(range);
  static constexpr Stops stops = {
      {{0.05, 0.04, 0.12}, {0.38, 0.12, 0.45}, {0.75, 0.24, 0.38}, {0.97, 0.58, 0.25}, {0.99, 0.95, 0.70}}};
  Colours out(values.size(), 3);
  for (Eigen::Index i = 0; i < values.size(); ++i) out.row(i) = at(stops, values[i] / range);
  return out;
}

}  // namespace facewright
