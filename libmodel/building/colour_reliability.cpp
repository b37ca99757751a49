// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/colour_reliability.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/core/median.h"
#include "libmodel/core/topology.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

// 0 at `none`, 1 at `all`, straight between; either may be the larger.
double ramp(double x, double none, double all) { return std::clamp((x - none) / (all - none), 0.0, 1.0); }

double longest_side(const Mesh& m, int f) {
  double longest = 0;
  for (int k = 0; k < 3; ++k) longest = std::max(longest, (m.V.row(m.F(f, k)) - m.V.row(m.F(f, (k + 1) % 3))).norm());
  return longest;
}

double median_side(const Mesh& m) {
  std::vector<double> sides;
  for (int f = 0; f < m.F.rows(); ++f)
    for (int k = 0; k < 3; ++k) sides.push_back((m.V.row(m.F(f, k)) - m.V.row(m.F(f, (k + 1) % 3))).norm());
  return median_of(sides);
}

Eigen::VectorXd border_distances(const Mesh& scan, const Vertices& at) {
  const std::vector<bool> border = boundary_vertices(scan.V.rows(), scan.F);
  std::vector<int> rows;
  for (size_t v = 0; v < border.size(); ++v)
    if (border[v]) rows.push_back(static_cast<int>(v));
  if (rows.empty()) return Eigen::VectorXd::Constant(at.rows(), 1e9);
  const Vertices points = scan.V(rows, Eigen::all);
  const std::vector<int> nearest = PointIndex(points).nearest(at);
  Eigen::VectorXd distance(at.rows());
  for (Eigen::Index i = 0; i < at.rows(); ++i)
    distance[i] = (points.row(nearest[static_cast<size_t>(i)]) - at.row(i)).norm();
  return distance;
}

// Area of the places of a vertex's triangles over the area of the triangles.
Eigen::VectorXd stretches(const Vertices& V, const Faces& F, const Vertices& places) {
  const Eigen::VectorXd own = vertex_areas(V, F), there = vertex_areas(places, F);
  return (there.array() / own.array().max(1e-12)).matrix();
}

}  // namespace

Eigen::VectorXd colour_reliability(const Vertices& V, const Faces& F, const Mesh& scan,
                                   const std::vector<NearestPoint>& places, const ColourReliabilityOptions& o) {
  if (static_cast<Eigen::Index>(places.size()) != V.rows())
    throw InvalidInput("colour reliability: one place per vertex is needed");
  Vertices at(V.rows(), 3);
  for (Eigen::Index i = 0; i < V.rows(); ++i) at.row(i) = places[static_cast<size_t>(i)].position.transpose();
  const Vertices normals = vertex_normals(V, F), scan_normals = vertex_normals(scan.V, scan.F);
  const Eigen::VectorXd border = border_distances(scan, at), stretch = stretches(V, F, at);
  const double side = median_side(scan), degree = std::numbers::pi / 180;
  Eigen::VectorXd weights(V.rows());
  for (Eigen::Index i = 0; i < V.rows(); ++i) {
    const NearestPoint& place = places[static_cast<size_t>(i)];
    const Eigen::Vector3d n = position(place.where, scan_normals, scan.F).normalized();
    const double angle = std::acos(std::clamp(normals.row(i).dot(n), -1.0, 1.0));
    weights[i] = ramp(place.distance, o.far_mm, o.near_mm) *
                 ramp(angle, o.grazing_deg * degree, o.upright_deg * degree) *
                 ramp(border[i], o.least_border_mm, o.border_mm) * ramp(stretch[i], o.least_stretch, o.stretch) *
                 ramp(longest_side(scan, place.where.triangle), o.widest_edges * side, o.filled_edges * side);
  }
  return weights;
}

}  // namespace facewright
