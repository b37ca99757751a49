// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/denoise_filters.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "libmodel/geometry/normals.h"
#include "libregister/registration/denoise_quadric.h"
#include "libregister/registration/denoise_spikes.h"

namespace facewright {
namespace {

bool is_inner(const ScanGraph& graph, const Vertices& N, int i) {
  return !graph.border[static_cast<size_t>(i)] && graph.ring.degree(i) >= 3 && N.row(i).squaredNorm() > 0;
}

// Largest sum of squared residuals that noise alone explains: its mean and some standard deviations.
double bound_of(double freedom, double noise, double deviations) {
  const double f = std::max(freedom, 1e-9);
  return noise * noise * (f + deviations * std::sqrt(2 * f));
}

}  // namespace

Vertices project_on_quadrics(const Vertices& V, const Faces& F, const ScanGraph& graph, double noise, double mean_edge,
                             const DenoiseOptions& options) {
  const Vertices N = sturdy_normals(V, F, graph);
  Vertices out = V;
  RingGatherer gatherer(graph);
  const int widest =
      std::min(options.widest, static_cast<int>(std::min(1e6, options.widest_mm / std::max(mean_edge, 1e-9))));
  const double unit = 2 * mean_edge, reach = options.gaussian_width * mean_edge, per_reach = 1 / (reach * reach);
  for (int i = 0; i < V.rows(); ++i) {
    if (!is_inner(graph, N, i)) continue;
    const Eigen::Vector3d x = V.row(i), n = N.row(i);
    LocalQuadric quadric(x, n, unit);
    quadric.add(x, 1);
    const std::vector<int>& points = gatherer.around(i, 2);
    size_t next = 0;
    double height = 0, low = -2 * unit, high = 2 * unit;
    for (int rings = 2;; ++rings, gatherer.grow()) {
      for (; next < points.size(); ++next) {
        const Eigen::Vector3d p = V.row(points[next]);
        const double inside = 1 - (p - x).squaredNorm() * per_reach;
        if (inside > 0) quadric.add(p, inside * inside);
      }
      const LocalQuadric::Value fit = quadric.at_origin();
      if (fit.valid) {
        if (rings > 2 && fit.residual > bound_of(fit.freedom, noise, options.misfit)) break;
        const double slack = options.agreement * noise * std::sqrt(fit.variance);
        low = std::max(low, fit.height - slack), high = std::min(high, fit.height + slack);
        if (low > high) break;
        height = fit.height;
      }
      if (rings >= widest) break;
    }
    out.row(i) += height * n.transpose();
  }
  return out;
}

Vertices median_heights(const Vertices& V, const Faces& F, const ScanGraph& graph) {
  const Vertices N = vertex_normals(V, F);
  Vertices out = V;
  RingGatherer gatherer(graph);
  std::vector<double> heights;
  for (int i = 0; i < V.rows(); ++i) {
    if (!is_inner(graph, N, i)) continue;
    heights.assign(1, 0);
    for (const int j : gatherer.around(i, 2)) heights.push_back(N.row(i).dot(V.row(j) - V.row(i)));
    const auto mid = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
    std::nth_element(heights.begin(), mid, heights.end());
    out.row(i) += *mid * N.row(i);
  }
  return out;
}

Vertices smooth_borders(const Vertices& V, const Faces& F, const ScanGraph& graph, double noise) {
  const Vertices N = sturdy_normals(V, F, graph);
  Vertices out = V;
  for (int i = 0; i < V.rows(); ++i) {
    if (graph.border_ring.degree(i) != 2) continue;
    const int a = graph.border_ring.begin(i)[0], b = graph.border_ring.begin(i)[1];
    const double la = (V.row(a) - V.row(i)).norm(), lb = (V.row(b) - V.row(i)).norm();
    if (la + lb <= 0) continue;
    const Eigen::RowVector3d chord = (lb * V.row(a) + la * V.row(b)) / (la + lb);
    const double height = N.row(i).dot(chord - V.row(i));
    if (std::abs(height) <= 3 * noise) out.row(i) += 0.5 * height * N.row(i);  // a corner of the border is not noise
  }
  return out;
}

}  // namespace facewright
