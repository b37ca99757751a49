// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/synthetic/range_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "libmodel/core/random.h"

namespace facewright {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

struct Hit {
  int triangle = -1;
  double range = 0;
  Vector3d barycentric = Vector3d::Zero();
};

class Grid {
 public:
  explicit Grid(const RangeGridLayout& layout)
      : o_(layout),
        step_{layout.spacing / layout.radius, layout.spacing * std::sqrt(0.75)},
        columns_(static_cast<int>(2 * layout.half_angle / step_.x()) + 1),
        rows_(static_cast<int>((layout.top - layout.bottom) / step_.y()) + 1) {
    Random random = Random::stream(layout.seed, 0x67726964);
    const Vector2d phase{random.uniform(), random.uniform()};
    for (int r = 0; r < rows_; ++r)
      for (int c = 0; c < columns_; ++c) {
        const Vector2d jitter{random.uniform(-o_.jitter, o_.jitter), random.uniform(-o_.jitter, o_.jitter)};
        const Vector2d cell = Vector2d{c + (r % 2 ? 0.5 : 0.0), static_cast<double>(r)} + jitter + phase;
        places_.emplace_back(-o_.half_angle + cell.x() * step_.x(), o_.bottom + cell.y() * step_.y());
      }
    hits_.resize(places_.size());
  }

  /// Casts one triangle onto the samples it covers.
  void cast(int triangle, const std::array<Vector3d, 3>& corners) {
    std::array<Vector2d, 3> at;
    std::array<double, 3> range;
    for (size_t k = 0; k < 3; ++k) {
      const double z = corners[k].z() - o_.axis_z;
      at[k] = {std::atan2(corners[k].x(), z), corners[k].y()};
      range[k] = std::hypot(corners[k].x(), z);
    }
    const auto [left, right] = std::minmax({at[0].x(), at[1].x(), at[2].x()});
    if (right - left > std::numbers::pi / 2) return;  // straddles the back
    const auto [low, high] = std::minmax({at[0].y(), at[1].y(), at[2].y()});
    const double area = cross(at[1] - at[0], at[2] - at[0]);
    if (std::abs(area) < 1e-14) return;
    const int c0 = column(left) - 2, c1 = column(right) + 2, r0 = row(low) - 2, r1 = row(high) + 2;
    for (int r = std::max(r0, 0); r <= std::min(r1, rows_ - 1); ++r)
      for (int c = std::max(c0, 0); c <= std::min(c1, columns_ - 1); ++c) {
        const size_t i = index(r, c);
        const double b1 = cross(places_[i] - at[0], at[2] - at[0]) / area;
        const double b2 = cross(at[1] - at[0], places_[i] - at[0]) / area, b0 = 1 - b1 - b2;
        if (b0 < 0 || b1 < 0 || b2 < 0) continue;
        const double z = b0 * range[0] + b1 * range[1] + b2 * range[2];
        if (z > hits_[i].range) hits_[i] = {triangle, z, {b0, b1, b2}};
      }
  }

  RangeSamples take() const {
    RangeSamples result;
    std::vector<int> sample(hits_.size(), -1);
    for (size_t i = 0; i < hits_.size(); ++i) {
      if (hits_[i].triangle < 0) continue;
      sample[i] = static_cast<int>(result.points.size());
      result.points.push_back({hits_[i].triangle, hits_[i].barycentric});
      result.place.push_back(places_[i]);
    }
    std::vector<std::array<int, 3>> faces;
    const auto add = [&](size_t a, size_t b, size_t c) {
      if (sample[a] >= 0 && sample[b] >= 0 && sample[c] >= 0) faces.push_back({sample[a], sample[b], sample[c]});
    };
    for (int r = 0; r + 1 < rows_; ++r)
      for (int c = 0; c + 1 < columns_; ++c) {
        const size_t a = index(r, c), b = index(r, c + 1), d = index(r + 1, c), e = index(r + 1, c + 1);
        if (r % 2 == 0) {
          add(a, b, d);
          add(b, e, d);
        } else {
          add(a, b, e);
          add(a, e, d);
        }
      }
    result.F.resize(static_cast<Eigen::Index>(faces.size()), 3);
    for (size_t f = 0; f < faces.size(); ++f)
      result.F.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
    return result;
  }

 private:
  static double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }
  int column(double angle) const { return static_cast<int>(std::floor((angle + o_.half_angle) / step_.x())); }
  int row(double height) const { return static_cast<int>(std::floor((height - o_.bottom) / step_.y())); }
  size_t index(int r, int c) const {
    return static_cast<size_t>(r) * static_cast<size_t>(columns_) + static_cast<size_t>(c);
  }

  RangeGridLayout o_;
  Vector2d step_;
  int columns_, rows_;
  std::vector<Vector2d> places_;
  std::vector<Hit> hits_;
};

}  // namespace

RangeSamples sample_outermost(const Vertices& V, const Faces& F, const RangeGridLayout& layout) {
  Grid grid(layout);
  for (int f = 0; f < static_cast<int>(F.rows()); ++f)
    grid.cast(f, {V.row(F(f, 0)).transpose(), V.row(F(f, 1)).transpose(), V.row(F(f, 2)).transpose()});
  return grid.take();
}

}  // namespace facewright
