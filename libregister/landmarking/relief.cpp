// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/relief.h"

#include <algorithm>
#include <cmath>

namespace facewright {
namespace {

using Field = Eigen::Array<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

std::vector<float> gaussian(double sigma) {
  const int reach = static_cast<int>(std::ceil(2.5 * sigma));
  std::vector<float> kernel;
  for (int k = -reach; k <= reach; ++k) kernel.push_back(static_cast<float>(std::exp(-0.5 * k * k / (sigma * sigma))));
  return kernel;
}

Field smoothed(const Field& x, double sigma) {
  const std::vector<float> kernel = gaussian(sigma);
  const int reach = static_cast<int>(kernel.size()) / 2;
  Field rows = Field::Zero(x.rows(), x.cols()), both = rows;
  for (int k = -reach; k <= reach; ++k) {
    const float w = kernel[static_cast<size_t>(k + reach)];
    const Eigen::Index n = x.cols() - std::abs(k);
    if (n > 0) rows.middleCols(std::max(0, -k), n) += w * x.middleCols(std::max(0, k), n);
  }
  for (int k = -reach; k <= reach; ++k) {
    const float w = kernel[static_cast<size_t>(k + reach)];
    const Eigen::Index n = x.rows() - std::abs(k);
    if (n > 0) both.middleRows(std::max(0, -k), n) += w * rows.middleRows(std::max(0, k), n);
  }
  return both;
}

// Depths without spikes: the median of the pixels around, where most are seen.
void despike(const Raster& raster, Field* depth, Field* seen) {
  constexpr int kReach = 2;
  std::vector<float> around;
  for (int y = 0; y < raster.height; ++y)
    for (int x = 0; x < raster.width; ++x) {
      around.clear();
      for (int dy = -kReach; dy <= kReach; ++dy)
        for (int dx = -kReach; dx <= kReach; ++dx)
          if (raster.inside(x + dx, y + dy) && raster.triangle[raster.index(x + dx, y + dy)] >= 0)
            around.push_back(raster.depth[raster.index(x + dx, y + dy)]);
      if (around.size() < 13) continue;
      const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
      std::nth_element(around.begin(), middle, around.end());
      (*depth)(y, x) = *middle;
      (*seen)(y, x) = 1;
    }
}

}  // namespace

Relief relief(const Raster& raster, double mm_per_pixel, double mm_per_depth, const ReliefOptions& options) {
  Field depth = Field::Zero(raster.height, raster.width), seen = depth;
  despike(raster, &depth, &seen);
  const float n = std::max(1.f, seen.sum()), middle = depth.sum() / n;
  depth = (depth - middle) * seen * static_cast<float>(mm_per_depth);
  const double fine = options.fine / mm_per_pixel, broad = options.broad / mm_per_pixel;
  const Field near = smoothed(seen, fine), far = smoothed(seen, broad);
  const Field rise = smoothed(depth, fine) / near.max(1e-6f) - smoothed(depth, broad) / far.max(1e-6f);
  const float whole = static_cast<float>(2 * 3.14159265 * broad * broad);
  Relief result{raster.width, raster.height, {}, {}};
  const float highest = static_cast<float>(options.highest);
  for (Eigen::Index y = 0; y < rise.rows(); ++y)
    for (Eigen::Index x = 0; x < rise.cols(); ++x) {
      const bool known = seen(y, x) > 0 && far(y, x) > 0.5f * whole;
      result.seen.push_back(known);
      result.rise.push_back(known ? std::clamp(rise(y, x), -highest, highest) : 0);
    }
  return result;
}

namespace {

struct Patch {
  std::vector<int> dx, dy;
  std::vector<double> weight, value;
};

// Of wide patches every second or third pixel: reliefs are smooth.
Patch cut_out(const Relief& pattern, int cx, int cy, double sigma) {
  Patch patch;
  const int step = std::max(1, static_cast<int>(sigma / 8)),
            reach = step * static_cast<int>(std::ceil(2 * sigma / step));
  for (int dy = -reach; dy <= reach; dy += step)
    for (int dx = -reach; dx <= reach; dx += step) {
      if (dx * dx + dy * dy > reach * reach || !pattern.has(cx + dx, cy + dy)) continue;
      patch.dx.push_back(dx);
      patch.dy.push_back(dy);
      patch.weight.push_back(std::exp(-0.5 * (dx * dx + dy * dy) / (sigma * sigma)));
      patch.value.push_back(pattern.rise[pattern.index(cx + dx, cy + dy)]);
    }
  return patch;
}

struct Moments {
  double w = 0, a = 0, b = 0, aa = 0, ab = 0, bb = 0;
};

// Correlation of the patch with the scan about (cx, cy). Below -1: too little of it is seen.
double correlation(const Patch& patch, const Relief& scan, int cx, int cy, double whole) {
  Moments m;
  for (size_t i = 0; i < patch.dx.size(); ++i) {
    const int x = cx + patch.dx[i], y = cy + patch.dy[i];
    if (!scan.has(x, y)) continue;
    const double w = patch.weight[i], a = patch.value[i], b = scan.rise[scan.index(x, y)];
    m.w += w;
    m.a += w * a;
    m.b += w * b;
    m.aa += w * a * a;
    m.ab += w * a * b;
    m.bb += w * b * b;
  }
  if (m.w < 0.5 * whole) return -2;
  const double a = m.aa - m.a * m.a / m.w, b = m.bb - m.b * m.b / m.w;
  return a > 0 && b > 0 ? (m.ab - m.a * m.b / m.w) / std::sqrt(a * b) : -2;
}

double deviation(const Patch& patch) {
  double w = 0, sum = 0, squares = 0;
  for (size_t i = 0; i < patch.value.size(); ++i) {
    w += patch.weight[i];
    sum += patch.weight[i] * patch.value[i];
    squares += patch.weight[i] * patch.value[i] * patch.value[i];
  }
  return w > 0 ? std::sqrt(std::max(0.0, squares / w - sum * sum / w / w)) : 0;
}

// The vertex of the parabola through three equidistant values, about the middle one.
double peak(double before, double at, double after) {
  const double bend = before - 2 * at + after;
  return bend < -1e-12 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0;
}

}  // namespace

std::optional<PatchMatch> match_relief(const Relief& pattern, const Relief& scan, const Eigen::Vector2d& point,
                                       double mm_per_pixel, const PatchMatchOptions& options) {
  const int cx = static_cast<int>(std::lround(point.x())), cy = static_cast<int>(std::lround(point.y()));
  const Patch patch = cut_out(pattern, cx, cy, options.patch / mm_per_pixel);
  double whole = 0;
  for (const double w : patch.weight) whole += w;
  if (patch.value.size() < 30 || deviation(patch) < options.least_rise) return {};
  const double reach = options.reach / mm_per_pixel;
  const int R = static_cast<int>(std::ceil(reach)), side = 2 * R + 1;
  std::vector<double> score(static_cast<size_t>(side * side), -3);
  const auto at = [&](int x, int y) -> double& { return score[static_cast<size_t>((y + R) * side + x + R)]; };
  int bx = 0, by = 0;
  for (int y = -R; y <= R; ++y)
    for (int x = -R; x <= R; ++x) {
      const double far = (x * x + y * y) / (reach * reach);
      if (far > 1) continue;
      at(x, y) = correlation(patch, scan, cx + x, cy + y, whole) - options.penalty * far;
      if (at(x, y) > at(bx, by)) bx = x, by = y;
    }
  if (at(bx, by) <= -1) return {};
  PatchMatch match;
  match.offset = Eigen::Vector2d(bx, by);
  if (std::abs(bx) < R && std::abs(by) < R && at(bx - 1, by) > -2 && at(bx + 1, by) > -2 && at(bx, by - 1) > -2 &&
      at(bx, by + 1) > -2)
    match.offset += Eigen::Vector2d(peak(at(bx - 1, by), at(bx, by), at(bx + 1, by)),
                                    peak(at(bx, by - 1), at(bx, by), at(bx, by + 1)));
  match.correlation = at(bx, by) + options.penalty * (bx * bx + by * by) / (reach * reach);
  return match;
}

}  // namespace facewright
