// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/residual_field.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/geometry/laplacian.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Solver = Eigen::SimplicialLDLT<Sparse>;

// Rows and columns `rows` of A.
Sparse principal_submatrix(const Sparse& A, const std::vector<int>& rows) {
  std::vector<int> place(static_cast<size_t>(A.rows()), -1);
  for (size_t i = 0; i < rows.size(); ++i) place[static_cast<size_t>(rows[i])] = static_cast<int>(i);
  std::vector<Eigen::Triplet<double>> entries;
  for (const int col : rows)
    for (Sparse::InnerIterator it(A, col); it; ++it)
      if (place[static_cast<size_t>(it.row())] >= 0)
        entries.emplace_back(place[static_cast<size_t>(it.row())], place[static_cast<size_t>(col)], it.value());
  const auto n = static_cast<Eigen::Index>(rows.size());
  Sparse sub(n, n);
  sub.setFromTriplets(entries.begin(), entries.end());
  return sub;
}

}  // namespace

ResidualField::ResidualField(const Vertices& V, const Faces& F, double length)
    : ring_(vertex_neighbours(V.rows(), F)), stiffness_(cotangent_stiffness(V, F)) {
  if (!(length > 0)) throw InvalidInput("residual field: the correlation length must be positive");
  const double edge = mean_edge_length(V, F);
  reach_ = std::clamp(static_cast<int>(std::ceil(0.75 * length / std::max(edge, 1e-9))), 2, 12);
  Eigen::VectorXd mass = vertex_areas(V, F);
  mass = mass.cwiseMax(1e-6 * std::max(mass.mean(), 1e-12));
  const double k2 = 1 / (length * length);
  Sparse A = stiffness_;
  for (Eigen::Index i = 0; i < V.rows(); ++i) A.coeffRef(i, i) += k2 * mass[i];
  precision_ = (A * mass.cwiseInverse().asDiagonal() * A) / (4 * std::numbers::pi * k2);
}

ResidualField::Correlation ResidualField::along_edges(const Vertices& residual, const Eigen::VectorXd& weights) const {
  Correlation sum;
  for (int i = 0; i < ring_.size(); ++i)
    for (const int* j = ring_.begin(i); j != ring_.end(i); ++j) {
      if (*j < i) continue;
      const double w = weights[i] * weights[*j];
      if (w <= 0) continue;
      sum.product += w * residual.row(i).dot(residual.row(*j));
      sum.square += w * 0.5 * (residual.row(i).squaredNorm() + residual.row(*j).squaredNorm());
    }
  return sum;
}

std::vector<int> ResidualField::surroundings(const Eigen::VectorXd& weights) const {
  std::vector<int> list;
  std::vector<bool> in(static_cast<size_t>(ring_.size()), false);
  for (int v = 0; v < ring_.size(); ++v)
    if (weights[v] < 1) list.push_back(v), in[static_cast<size_t>(v)] = true;
  size_t first = 0;
  for (int ring = 0; ring < reach_; ++ring) {
    const size_t last = list.size();
    for (; first < last; ++first) {
      const int v = list[first];
      for (const int* j = ring_.begin(v); j != ring_.end(v); ++j)
        if (!in[static_cast<size_t>(*j)]) in[static_cast<size_t>(*j)] = true, list.push_back(*j);
    }
  }
  std::sort(list.begin(), list.end());
  return list;
}

Vertices ResidualField::expect(const Vertices& residual, const Eigen::VectorXd& weights, double nugget) const {
  const std::vector<int> rows = surroundings(weights);
  Vertices field = Vertices::Zero(residual.rows(), 3);
  if (rows.empty()) return field;
  Sparse A = principal_submatrix(precision_, rows);
  Vertices b(A.rows(), 3);
  for (Eigen::Index i = 0; i < A.rows(); ++i) {
    const int v = rows[static_cast<size_t>(i)];
    A.coeffRef(i, i) += weights[v] / nugget;
    b.row(i) = weights[v] / nugget * residual.row(v);
  }
  const Solver solver(A);
  if (solver.info() != Eigen::Success) throw SolverError("filling unseen values: the field's system is singular");
  const Vertices x = solver.solve(Eigen::MatrixXd(b));
  for (Eigen::Index i = 0; i < A.rows(); ++i)
    if (weights[rows[static_cast<size_t>(i)]] < 1) field.row(rows[static_cast<size_t>(i)]) = x.row(i);
  return field;
}

void ResidualField::fill_harmonically(Eigen::Ref<Eigen::MatrixXd> X, const std::vector<bool>& known) const {
  // Only what is connected to something known; the rest would make the system singular.
  std::vector<int> reached, rows;
  std::vector<bool> in = known;
  for (int v = 0; v < ring_.size(); ++v)
    if (known[static_cast<size_t>(v)]) reached.push_back(v);
  for (size_t i = 0; i < reached.size(); ++i)
    for (const int* j = ring_.begin(reached[i]); j != ring_.end(reached[i]); ++j)
      if (!in[static_cast<size_t>(*j)]) in[static_cast<size_t>(*j)] = true, reached.push_back(*j), rows.push_back(*j);
  if (rows.empty()) return;
  std::sort(rows.begin(), rows.end());
  Eigen::MatrixXd fixed = X;
  for (int v = 0; v < ring_.size(); ++v)
    if (!known[static_cast<size_t>(v)]) fixed.row(v).setZero();
  const Eigen::MatrixXd pull = stiffness_ * fixed;
  const Solver solver(principal_submatrix(stiffness_, rows));
  if (solver.info() != Eigen::Success) throw SolverError("filling unseen values: the harmonic system is singular");
  const Eigen::MatrixXd x = solver.solve(Eigen::MatrixXd(-pull(rows, Eigen::all)));
  X(rows, Eigen::all) = x;
}

Eigen::RowVectorXd ResidualField::spread_about_neighbours(const Eigen::MatrixXd& X,
                                                          const std::vector<bool>& known) const {
  Eigen::RowVectorXd squares = Eigen::RowVectorXd::Zero(X.cols());
  double count = 0;
  for (int v = 0; v < ring_.size(); ++v) {
    const auto is_known = [&](int j) { return known[static_cast<size_t>(j)]; };
    if (ring_.degree(v) == 0 || !is_known(v) || !std::all_of(ring_.begin(v), ring_.end(v), is_known)) continue;
    Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(X.cols());
    for (const int* j = ring_.begin(v); j != ring_.end(v); ++j) mean += X.row(*j);
    squares += (X.row(v) - mean / ring_.degree(v)).cwiseAbs2();
    ++count;
  }
  return squares / std::max(count, 1.0);
}

}  // namespace facewright
