// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/uv/unfolding.h"

#include <Eigen/Geometry>
#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/uv/distortion.h"

namespace facewright {
namespace {

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

// tan(angle / 2) at the corner between a and b.
double half_tangent(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return a.cross(b).norm() / std::max(1e-12 * a.norm() * b.norm(), a.norm() * b.norm() + a.dot(b));
}

// Mean-value weights of the surface: w_ij = (tan(alpha/2) + tan(beta/2)) / |ij|, rows summing to 1. [floater2003]
SparseMatrix mean_value_weights(const Vertices& V, const Faces& F) {
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      const int i = F(f, k), j = F(f, (k + 1) % 3), l = F(f, (k + 2) % 3);
      const Eigen::Vector3d a = V.row(j) - V.row(i), b = V.row(l) - V.row(i);
      const double t = std::max(1e-6, half_tangent(a, b));
      entries.emplace_back(i, j, t / std::max(1e-9, a.norm()));
      entries.emplace_back(i, l, t / std::max(1e-9, b.norm()));
    }
  SparseMatrix W(V.rows(), V.rows());
  W.setFromTriplets(entries.begin(), entries.end());
  const Eigen::VectorXd sums = W * Eigen::VectorXd::Ones(V.rows());
  return (sums.cwiseInverse().asDiagonal() * W).eval();
}

double smallest_area(const TexCoords& uv, const Faces& F, const Adjacency& incident, int v) {
  double smallest = std::numeric_limits<double>::max();
  for (const int* f = incident.begin(v); f != incident.end(v); ++f) {
    const Eigen::RowVector2d a = uv.row(F(*f, 0)), b = uv.row(F(*f, 1)) - a, c = uv.row(F(*f, 2)) - a;
    smallest = std::min(smallest, b.x() * c.y() - b.y() * c.x());
  }
  return smallest;
}

// Moves the vertex towards its neighbours' mean-value point as long as its worst triangle gets better.
void move_into_kernel(TexCoords& uv, const Faces& F, const Adjacency& incident, const SparseMatrix& W, int v) {
  const double before = smallest_area(uv, F, incident, v);
  const Eigen::RowVector2d from = uv.row(v), to = W.row(v) * uv;
  for (double t : {1.0, 0.5, 0.25, 0.1}) {
    uv.row(v) = from + t * (to - from);
    if (smallest_area(uv, F, incident, v) > before) return;
  }
  uv.row(v) = from;
}

TexCoords vertex_moves(const Faces& F, TexCoords uv, const std::vector<int>& mirror, const SparseMatrix& W,
                       int sweeps) {
  const Adjacency incident = vertex_faces(uv.rows(), F);
  for (int sweep = 0; sweep < sweeps && count_flips(uv, F) > 0; ++sweep) {
    const Eigen::VectorXd areas = signed_areas(uv, F);
    for (Eigen::Index f = 0; f < F.rows(); ++f)
      if (areas[f] <= 0)
        for (int k = 0; k < 3; ++k) move_into_kernel(uv, F, incident, W, F(f, k));
    uv = symmetrised(uv, mirror);
  }
  return uv;
}

// Solves uv_i = sum_j W_ij uv_j inside, given the border.
TexCoords mean_value_map(const TexCoords& border_uv, const std::vector<bool>& fixed, const SparseMatrix& W) {
  const Eigen::Index n = W.rows();
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixXd rhs = Eigen::MatrixXd::Zero(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    entries.emplace_back(i, i, 1);
    if (fixed[static_cast<size_t>(i)]) {
      rhs.row(i) = border_uv.row(i);
      continue;
    }
    for (SparseMatrix::InnerIterator w(W, i); w; ++w) entries.emplace_back(i, w.col(), -w.value());
  }
  Eigen::SparseMatrix<double> A(n, n);
  A.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseLU<Eigen::SparseMatrix<double>> lu(A);
  if (lu.info() != Eigen::Success) throw SolverError("uv: the mean-value system is singular");
  const Eigen::MatrixXd solution = lu.solve(rhs);
  return solution;
}

double turn(const Eigen::RowVector2d& a, const Eigen::RowVector2d& b, const Eigen::RowVector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

// Counter-clockwise convex hull (Andrew's monotone chain).
std::vector<Eigen::RowVector2d> convex_hull(std::vector<Eigen::RowVector2d> points) {
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y()); });
  std::vector<Eigen::RowVector2d> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const size_t start = hull.size();
    for (const auto& p : points) {
      while (hull.size() >= start + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

// Point at `share` of the length of a closed polygon.
Eigen::RowVector2d point_along(const std::vector<Eigen::RowVector2d>& polygon, double share) {
  const size_t n = polygon.size();
  double length = 0;
  for (size_t i = 0; i < n; ++i) length += (polygon[(i + 1) % n] - polygon[i]).norm();
  double rest = (share - std::floor(share)) * length;
  for (size_t i = 0;; i = (i + 1) % n) {
    const double side = (polygon[(i + 1) % n] - polygon[i]).norm();
    if (rest <= side) return polygon[i] + rest / side * (polygon[(i + 1) % n] - polygon[i]);
    rest -= side;
  }
}

// The border spread over the hull of the map by its length on the surface, turned to stay near where it was.
TexCoords border_on_hull(const Vertices& V, const std::vector<int>& loop, TexCoords uv) {
  std::vector<Eigen::RowVector2d> points;
  for (int v : loop) points.push_back(uv.row(v));
  const auto hull = convex_hull(points);
  std::vector<double> at(loop.size() + 1, 0);
  for (size_t i = 0; i < loop.size(); ++i)
    at[i + 1] = at[i] + (V.row(loop[(i + 1) % loop.size()]) - V.row(loop[i])).norm();
  const auto placed = [&](double shift) {
    TexCoords moved = uv;
    for (size_t i = 0; i < loop.size(); ++i) moved.row(loop[i]) = point_along(hull, at[i] / at.back() + shift);
    return moved;
  };
  double best_shift = 0, best = std::numeric_limits<double>::max();
  for (int s = 0; s < 360; ++s) {
    const double distance = (placed(s / 360.0) - uv).squaredNorm();
    if (distance < best) best = distance, best_shift = s / 360.0;
  }
  return placed(best_shift);
}

}  // namespace

int count_flips(const TexCoords& uv, const Faces& F) {
  return static_cast<int>((signed_areas(uv, F).array() <= 0).count());
}

TexCoords symmetrised(const TexCoords& uv, const std::vector<int>& mirror) {
  TexCoords result = uv;
  for (size_t v = 0; v < mirror.size(); ++v) {
    const auto i = static_cast<Eigen::Index>(v);
    const Eigen::RowVector2d partner = uv.row(mirror[v]);
    result.row(i) = 0.5 * (uv.row(i) + Eigen::RowVector2d(-partner.x(), partner.y()));
  }
  return result;
}

UnfoldResult unfold(const Vertices& V, const Faces& F, const TexCoords& uv, const std::vector<int>& mirror,
                    int sweeps) {
  UnfoldResult result{uv, count_flips(uv, F), "none needed"};
  if (result.flips == 0) return result;
  const SparseMatrix W = mean_value_weights(V, F);
  const auto loops = boundary_loops(F);
  const auto attempt = [&](TexCoords candidate, const std::string& method) {
    candidate = symmetrised(candidate, mirror);
    const int flips = count_flips(candidate, F);
    if (flips < result.flips) result = {std::move(candidate), flips, method};
    return result.flips == 0;
  };
  if (attempt(vertex_moves(F, uv, mirror, W, sweeps), "vertex moves") || loops.empty()) return result;
  std::vector<bool> border(static_cast<size_t>(V.rows()), false);
  for (int v : loops.front()) border[static_cast<size_t>(v)] = true;
  if (attempt(mean_value_map(uv, border, W), "mean-value map on its border")) return result;
  attempt(mean_value_map(symmetrised(border_on_hull(V, loops.front(), uv), mirror), border, W),
          "mean-value map on the convex hull");
  return result;
}

}  // namespace facewright
