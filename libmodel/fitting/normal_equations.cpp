// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/normal_equations.h"

#include <algorithm>
#include <cmath>
#include <cstring>

// Compiled twice, the wider one taken where the processor has it. Numbers are never summed across the vector and
// products never fused, so both give the same bytes.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define FACEWRIGHT_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define FACEWRIGHT_WIDE
#endif

namespace facewright {
namespace {

/// The symmetric square root in closed form.
Eigen::Matrix2d square_root(const Information& W) {
  const double d = std::sqrt(std::max(0.0, W.determinant()));
  return (W + d * Eigen::Matrix2d::Identity()) / std::sqrt(W.trace() + 2 * d);
}

/// The direction of a weight of rank 1: W = w w^T.
Eigen::RowVector2d direction(const Information& W) {
  return {std::sqrt(std::max(0.0, W(0, 0))), std::copysign(std::sqrt(std::max(0.0, W(1, 1))), W(0, 1))};
}

constexpr Eigen::Index kTileRows = 8, kTileColumns = 4;  // of G, in registers
constexpr Eigen::Index kRowsAtOnce = 40;                 // of 70 numbers: within the innermost cache

/// Lower triangle of sum_k row_k^T row_k, by tiles; `columns` (also of G, which is added to) a multiple of eight.
FACEWRIGHT_WIDE void add_products(const double* rows, Eigen::Index count, Eigen::Index columns, double* G) {
  using Four = double __attribute__((vector_size(32), aligned(8)));
  for (Eigen::Index j = 0; j < columns; j += kTileRows)
    for (Eigen::Index i = 0; i < j + kTileRows; i += kTileColumns) {
      Four sum[kTileColumns][2];
      for (Eigen::Index c = 0; c < kTileColumns; ++c)
        for (Eigen::Index h = 0; h < 2; ++h) std::memcpy(&sum[c][h], G + (i + c) * columns + j + 4 * h, sizeof(Four));
      for (Eigen::Index k = 0; k < count; ++k) {
        const double *at_j = rows + k * columns + j, *at_i = rows + k * columns + i;
        Four low, high;
        std::memcpy(&low, at_j, sizeof low);
        std::memcpy(&high, at_j + 4, sizeof high);
        for (Eigen::Index c = 0; c < kTileColumns; ++c) {
          sum[c][0] += low * at_i[c];
          sum[c][1] += high * at_i[c];
        }
      }
      for (Eigen::Index c = 0; c < kTileColumns; ++c)
        for (Eigen::Index h = 0; h < 2; ++h) std::memcpy(G + (i + c) * columns + j + 4 * h, &sum[c][h], sizeof(Four));
    }
}

/// Steps of Gauss without pivots by the first p columns of a lower triangle (n x n); those columns are left as they
/// were met. Pivots at most `least[j]` are passed over. `inverse` (p) receives the reciprocal pivots.
FACEWRIGHT_WIDE void eliminate_columns(double* G, Eigen::Index n, Eigen::Index p, const double* least,
                                       double* inverse) {
  for (Eigen::Index i = 0; i < n; ++i) {
    double* __restrict column = G + i * n;
    const Eigen::Index before = std::min(i, p);
    Eigen::Index j = 0;
    for (; j + 4 <= before; j += 4) {
      const double* __restrict a = G + j * n, * __restrict b = a + n, * __restrict c = b + n, * __restrict d = c + n;
      const double fa = a[i] * inverse[j], fb = b[i] * inverse[j + 1], fc = c[i] * inverse[j + 2],
                   fd = d[i] * inverse[j + 3];
      for (Eigen::Index r = i; r < n; ++r) column[r] -= (fa * a[r] + fb * b[r]) + (fc * c[r] + fd * d[r]);
    }
    for (; j < before; ++j) {
      const double* __restrict a = G + j * n;
      const double fa = a[i] * inverse[j];
      for (Eigen::Index r = i; r < n; ++r) column[r] -= fa * a[r];
    }
    if (i < p) inverse[i] = column[i] > least[i] ? 1 / column[i] : 0;
  }
}

/// Rows of X (row-major, n x stride, unit lower triangular) become those of the inverse of L, whose columns are given
/// times their pivots.
FACEWRIGHT_WIDE void invert_unit_lower(const double* L, Eigen::Index n, double* X, Eigen::Index stride) {
  for (Eigen::Index j = 0; j < n; ++j) {
    const double pivot = 1 / L[j * n + j];
    const double* __restrict from = X + j * stride;
    for (Eigen::Index i = j + 1; i < n; ++i) {
      const double factor = pivot * L[j * n + i];
      double* __restrict to = X + i * stride;
      for (Eigen::Index c = 0; c <= j; ++c) to[c] -= factor * from[c];
    }
  }
}

Eigen::Index padded(Eigen::Index columns) { return (columns + kTileRows - 1) / kTileRows * kTileRows; }

}  // namespace

void whiten(WhitenedRows& out, const LandmarkShapeModel& model, const std::vector<Observation>& seen,
            const AffineCamera& camera, const std::vector<Information>& W, const Eigen::MatrixXd& nuisance) {
  const auto K = static_cast<Eigen::Index>(seen.size());
  const Eigen::Index P = nuisance.cols(), M = model.basis.cols();
  out.columns = P + M + 1;
  out.rows.resize(2 * K, padded(out.columns));
  out.rows.rightCols(out.rows.cols() - out.columns).setZero();
  out.count = 0;
  for (Eigen::Index k = 0; k < K; ++k) {
    const Information& weight = W[static_cast<size_t>(k)];
    const Eigen::Vector2d r = seen[static_cast<size_t>(k)].pixel - camera.project(model.mean.segment<3>(3 * k));
    const auto add = [&](const Eigen::RowVector2d& w) {
      auto row = out.rows.row(out.count++);
      if (P > 0) row.head(P) = w[0] * nuisance.row(2 * k) + w[1] * nuisance.row(2 * k + 1);
      const Eigen::RowVector3d a = w * camera.A;
      row.segment(P, M) =
          a[0] * model.basis.row(3 * k) + a[1] * model.basis.row(3 * k + 1) + a[2] * model.basis.row(3 * k + 2);
      row[P + M] = w * r;
    };
    if (determines_point(weight)) {
      const Eigen::Matrix2d root = square_root(weight);
      add(root.row(0));
      add(root.row(1));
    } else if (!weight.isZero(0)) {
      add(direction(weight));
    }
  }
}

void gram(Eigen::MatrixXd& out, const WhitenedRows& rows) {
  const Eigen::Index n = rows.columns, columns = rows.rows.cols();
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(columns, columns);
  for (Eigen::Index k = 0; k < rows.count; k += kRowsAtOnce)
    add_products(rows.rows.data() + k * columns, std::min(kRowsAtOnce, rows.count - k), columns, G.data());
  out = G.topLeftCorner(n, n);
}

void eliminate(Eigen::MatrixXd& G, Eigen::Index p) {
  const Eigen::VectorXd least = 1e-13 * G.diagonal().head(p);
  Eigen::VectorXd inverse(p);
  eliminate_columns(G.data(), G.rows(), p, least.data(), inverse.data());
}

bool PositiveDefiniteSolver::compute(const Eigen::MatrixXd& H) {
  const Eigen::Index n = H.rows();
  L_ = H;
  const Eigen::VectorXd least = Eigen::VectorXd::Zero(n);
  inverse_.resize(n);
  eliminate_columns(L_.data(), n, n, least.data(), inverse_.data());
  return n == 0 || (L_.diagonal().allFinite() && L_.diagonal().minCoeff() > 1e-13 * L_.diagonal().maxCoeff());
}

Eigen::VectorXd PositiveDefiniteSolver::solve(const Eigen::VectorXd& g) const {
  const Eigen::Index n = L_.rows();
  Eigen::VectorXd x = g;
  for (Eigen::Index j = 0; j < n; ++j) {
    x[j] *= inverse_[j];
    x.tail(n - 1 - j) -= x[j] * L_.col(j).tail(n - 1 - j);
  }
  for (Eigen::Index j = n - 2; j >= 0; --j) x[j] -= L_.col(j).tail(n - 1 - j).dot(x.tail(n - 1 - j)) * inverse_[j];
  return x;
}

Eigen::MatrixXd PositiveDefiniteSolver::inverse() const {
  const Eigen::Index n = L_.rows();
  WhitenedRows half;  // D^-1/2 L^-1, whose gram matrix is the inverse
  half.rows.setZero(n, padded(n));
  half.rows.diagonal().setOnes();
  half.count = half.columns = n;
  invert_unit_lower(L_.data(), n, half.rows.data(), half.rows.cols());
  for (Eigen::Index j = 0; j < n; ++j) half.rows.row(j) *= std::sqrt(inverse_[j]);
  Eigen::MatrixXd out;
  gram(out, half);
  out.triangularView<Eigen::StrictlyUpper>() = out.transpose();
  return out;
}

}  // namespace facewright
