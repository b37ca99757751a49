// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/normal_equations.h"

#include <algorithm>
#include <cmath>

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

}  // namespace

void whiten(WhitenedRows& out, const LandmarkShapeModel& model, const std::vector<Observation>& seen,
            const AffineCamera& camera, const std::vector<Information>& W, const Eigen::MatrixXd& nuisance) {
  const auto K = static_cast<Eigen::Index>(seen.size());
  const Eigen::Index P = nuisance.cols(), M = model.basis.cols();
  out.rows.resize(2 * K, P + M + 1);
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
  out.setZero(rows.rows.cols(), rows.rows.cols());
  out.selfadjointView<Eigen::Lower>().rankUpdate(rows.used().transpose());
}

void eliminate(Eigen::MatrixXd& G, Eigen::Index p) {
  const Eigen::Index n = G.rows();
  const Eigen::VectorXd before = G.diagonal().head(p);
  for (Eigen::Index j = 0; j < p; ++j) {
    if (!(G(j, j) > 1e-13 * before[j])) continue;
    const double pivot = 1 / G(j, j);
    for (Eigen::Index i = j + 1; i < n; ++i) G.col(i).tail(n - i) -= (pivot * G(i, j)) * G.col(j).tail(n - i);
  }
}

}  // namespace facewright
