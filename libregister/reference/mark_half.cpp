// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/reference/mark_half.h"

#include <algorithm>
#include <cmath>

#include "libmodel/core/topology.h"
#include "libmodel/surface/nearest.h"

namespace facewright {
namespace {

struct LinePlace {
  int a = -1, b = -1;
  double t = 0, distance = INFINITY;
};

// Nearest place on the edges that `on_line` accepts.
template <class OnLine>
LinePlace nearest_on_line(const HalfFace& half, const Eigen::Vector3d& p, const OnLine& on_line) {
  LinePlace best;
  for (const Edge& e : edges(half.F)) {
    if (!e.is_boundary() || !on_line(e)) continue;
    const Eigen::Vector3d a = half.shape.row(e.v0), ab = half.shape.row(e.v1).transpose() - a;
    const double t = std::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), 1e-12), 0.0, 1.0);
    if (const double d = (a + t * ab - p).norm(); d < best.distance) best = {e.v0, e.v1, t, d};
  }
  return best;
}

int vertex_on_line(HalfFace& half, const LinePlace& place, double snap) {
  const double length = (half.shape.row(place.a) - half.shape.row(place.b)).norm();
  if (place.t * length < snap) return place.a;
  if ((1 - place.t) * length < snap) return place.b;
  return split_edge(half, place.a, place.b, place.t);
}

// Vertices of the lip margin that holds `near`.
std::vector<bool> margin_of(const HalfFace& half, int near) {
  const auto [upper, lower] = lip_margins(half);
  const bool is_upper = std::find(upper.begin(), upper.end(), near) != upper.end();
  std::vector<bool> on(static_cast<size_t>(half.count()), false);
  for (const int v : is_upper ? upper : lower) on[static_cast<size_t>(v)] = true;
  return on;
}

std::vector<int> patch_triangles(const HalfFace& half, const LandmarkWish& wish, double radius) {
  std::vector<int> all;
  if (wish.near < 0) {
    for (int f = 0; f < half.F.rows(); ++f) all.push_back(f);
    return all;
  }
  const auto around = vertex_faces(half.count(), half.F);
  std::vector<bool> seen(static_cast<size_t>(half.count()), false);
  std::vector<int> queue{wish.near};
  seen[static_cast<size_t>(wish.near)] = true;
  for (size_t i = 0; i < queue.size(); ++i)
    for (const int* f = around.begin(queue[i]); f != around.end(queue[i]); ++f) {
      all.push_back(*f);
      for (int k = 0; k < 3; ++k) {
        const int v = half.F(*f, k);
        if (seen[static_cast<size_t>(v)] || (half.shape.row(v) - half.shape.row(wish.near)).norm() > radius) continue;
        seen[static_cast<size_t>(v)] = true;
        queue.push_back(v);
      }
    }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

int mark_on_surface(HalfFace& half, const LandmarkWish& wish, const MarkOptions& options) {
  int best = -1;
  Eigen::Vector3d where = Eigen::Vector3d::Zero();
  double least = INFINITY;
  for (const int f : patch_triangles(half, wish, options.patch)) {
    const Eigen::Vector3d a = half.shape.row(half.F(f, 0)), b = half.shape.row(half.F(f, 1)),
                          c = half.shape.row(half.F(f, 2));
    const Eigen::Vector3d w = nearest_on_triangle(wish.position, a, b, c);
    if (const double d = (w[0] * a + w[1] * b + w[2] * c - wish.position).norm(); d < least)
      least = d, best = f, where = w;
  }
  const auto corner = [&](int k) { return half.F(best, (k + 3) % 3); };
  const Eigen::RowVector3d p = where[0] * half.shape.row(corner(0)) + where[1] * half.shape.row(corner(1)) +
                               where[2] * half.shape.row(corner(2));
  for (int k = 0; k < 3; ++k)
    if ((half.shape.row(corner(k)) - p).norm() < options.snap) return corner(k);
  for (int k = 0; k < 3; ++k)
    if (where[k] < 0.03) {
      const double t = where[(k + 2) % 3] / (where[(k + 1) % 3] + where[(k + 2) % 3]);
      return vertex_on_line(half, {corner(k + 1), corner(k + 2), t, 0}, options.snap);
    }
  return split_triangle(half, best, where);
}

}  // namespace

int mark_on_half(HalfFace& half, const LandmarkWish& wish, const MarkOptions& options) {
  const auto flag = [](const std::vector<bool>& flags, int v) {
    return static_cast<bool>(flags[static_cast<size_t>(v)]);
  };
  if (wish.on_slit) {
    const std::vector<bool> margin = margin_of(half, wish.near);
    const auto place =
        nearest_on_line(half, wish.position, [&](const Edge& e) { return flag(margin, e.v0) && flag(margin, e.v1); });
    if (place.distance < options.slit_reach) {
      if (wish.on_midline) return wish.near;  // the one vertex of the margin that is on the midline
      return vertex_on_line(half, place, options.snap);
    }
  }
  if (wish.on_midline) {
    const auto place = nearest_on_line(
        half, wish.position, [&](const Edge& e) { return flag(half.midline, e.v0) && flag(half.midline, e.v1); });
    return vertex_on_line(half, place, options.snap);
  }
  return mark_on_surface(half, wish, options);
}

PullSummary draw_surface(HalfFace& half, const std::vector<SurfacePull>& pulls, const PullOptions& options) {
  constexpr double resting = 1e-3;  // mm
  const auto count = static_cast<Eigen::Index>(pulls.size());
  Eigen::MatrixXd share(half.count(), count);  // of a pull's step that each vertex takes
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::RowVector3d at = half.shape.row(pulls[static_cast<size_t>(i)].vertex);
    const Eigen::ArrayXd away = (half.shape.rowwise() - at).rowwise().squaredNorm();
    share.col(i) = (away * (-0.5 / (options.bump * options.bump))).exp();
  }
  if (count > 0) share.array().colwise() /= share.rowwise().sum().array().max(1.0).eval();
  PullSummary summary;
  for (;; ++summary.rounds) {
    Vertices steps = Vertices::Zero(count, 3);
    summary.farthest = 0;
    for (Eigen::Index i = 0; i < count; ++i) {
      const SurfacePull& pull = pulls[static_cast<size_t>(i)];
      const Eigen::RowVector3d way = pull.wanted.transpose() - half.shape.row(pull.vertex);
      const double distance = way.norm();
      summary.farthest = std::max(summary.farthest, distance);
      if (distance > options.near_enough) steps.row(i) = (1 - options.near_enough / distance) * way;
    }
    if (summary.farthest <= options.near_enough + resting || summary.rounds == options.most_rounds) return summary;
    half.shape += share * steps;
    for (int v = 0; v < half.count(); ++v)
      if (half.midline[static_cast<size_t>(v)]) half.shape(v, 0) = 0;
  }
}

}  // namespace facewright
