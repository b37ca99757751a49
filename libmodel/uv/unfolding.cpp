// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/uv/unfolding.h"

#include <Eigen/Geometry>
#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/uv/distortion.h"

namespace facewright {
namespace {

constexpr double kLeastArea = 1e-9;  // of the mean triangle's; below, rounding decides which way a triangle lies

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
    const double least = kLeastArea * areas.cwiseAbs().mean();
    for (Eigen::Index f = 0; f < F.rows(); ++f)
      if (!(areas[f] > least))
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

bool segments_meet(const Eigen::RowVector2d& a, const Eigen::RowVector2d& b, const Eigen::RowVector2d& c,
                   const Eigen::RowVector2d& d) {
  if ((a.cwiseMax(b).array() < c.cwiseMin(d).array()).any() || (c.cwiseMax(d).array() < a.cwiseMin(b).array()).any())
    return false;
  return turn(a, b, c) * turn(a, b, d) <= 0 && turn(c, d, a) * turn(c, d, b) <= 0;
}

// The border spread over a circle of the surface's area by its lengths, turned to stay near where it was. A circle is
// strictly convex: a border on straight sides would flatten triangles in its corners.
TexCoords border_on_circle(const Vertices& V, const Faces& F, const std::vector<int>& loop, TexCoords uv) {
  double area = 0;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const Eigen::Vector3d a = V.row(F(f, 1)) - V.row(F(f, 0)), b = V.row(F(f, 2)) - V.row(F(f, 0));
    area += 0.5 * a.cross(b).norm();
  }
  std::vector<double> at(loop.size() + 1, 0);
  double length = 0;
  for (size_t i = 0; i < loop.size(); ++i) length += (V.row(loop[(i + 1) % loop.size()]) - V.row(loop[i])).norm();
  const double least = 0.01 * length / static_cast<double>(loop.size());  // no two vertices in one place
  for (size_t i = 0; i < loop.size(); ++i)
    at[i + 1] = at[i] + std::max(least, (V.row(loop[(i + 1) % loop.size()]) - V.row(loop[i])).norm());
  Eigen::RowVector2d centre = Eigen::RowVector2d::Zero();
  for (int v : loop) centre += uv.row(v) / static_cast<double>(loop.size());
  double along = 0, across = 0;
  const auto on_circle = [&](size_t i, double shift) {
    const double angle = 2 * std::numbers::pi * at[i] / at.back() + shift;
    return Eigen::RowVector2d(std::cos(angle), std::sin(angle));
  };
  for (size_t i = 0; i < loop.size(); ++i) {
    const Eigen::RowVector2d p = on_circle(i, 0), q = uv.row(loop[i]) - centre;
    along += p.dot(q), across += p.x() * q.y() - p.y() * q.x();
  }
  const double shift = std::atan2(across, along), radius = std::sqrt(area / std::numbers::pi);
  for (size_t i = 0; i < loop.size(); ++i) uv.row(loop[i]) = radius * on_circle(i, shift);
  return uv;
}

// All neighbours count alike; where the mean-value weights of slivers are too uneven for the arithmetic.
SparseMatrix uniform_weights(Eigen::Index n, const Faces& F) {
  const Adjacency neighbours = vertex_neighbours(n, F);
  std::vector<Eigen::Triplet<double>> entries;
  for (int v = 0; v < n; ++v)
    for (const int* w = neighbours.begin(v); w != neighbours.end(v); ++w)
      entries.emplace_back(v, *w, 1.0 / neighbours.degree(v));
  SparseMatrix W(n, n);
  W.setFromTriplets(entries.begin(), entries.end());
  return W;
}

}  // namespace

int count_flips(const TexCoords& uv, const Faces& F) {
  const Eigen::VectorXd areas = signed_areas(uv, F);
  const double least = kLeastArea * areas.cwiseAbs().mean();
  return static_cast<int>(areas.size() - (areas.array() > least).count());
}

bool border_is_simple(const TexCoords& uv, const std::vector<int>& loop) {
  const size_t n = loop.size();
  for (size_t i = 0; i + 2 < n; ++i)
    for (size_t j = i + 2; j < n; ++j)
      if ((j + 1) % n != i &&
          segments_meet(uv.row(loop[i]), uv.row(loop[i + 1]), uv.row(loop[j]), uv.row(loop[(j + 1) % n])))
        return false;
  return true;
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
  const std::vector<int> loop = boundary_loops(F).front();
  UnfoldResult result{uv, count_flips(uv, F), border_is_simple(uv, loop), "none needed"};
  if (result.one_to_one()) return result;
  const auto attempt = [&](TexCoords candidate, const std::string& method) {
    candidate = symmetrised(candidate, mirror);
    result = {candidate, count_flips(candidate, F), border_is_simple(candidate, loop), method};
    return result.one_to_one();
  };
  const SparseMatrix W = mean_value_weights(V, F);
  std::vector<bool> border(static_cast<size_t>(V.rows()), false);
  for (int v : loop) border[static_cast<size_t>(v)] = true;
  if (result.simple_border && (attempt(vertex_moves(F, uv, mirror, W, sweeps), "vertex moves") ||
                               attempt(mean_value_map(uv, border, W), "mean-value map on its border")))
    return result;
  const TexCoords circle = symmetrised(border_on_circle(V, F, loop, uv), mirror);
  if (!attempt(mean_value_map(circle, border, W), "mean-value map on a circle"))
    attempt(mean_value_map(circle, border, uniform_weights(V.rows(), F)), "uniform map on a circle");
  return result;
}

}  // namespace facewright
