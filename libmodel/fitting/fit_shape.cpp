// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/fit_shape.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

/// The symmetric square root of a weight.
Eigen::Matrix2d square_root(const Information& W) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(W);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() *
         eigen.eigenvectors().transpose();
}

}  // namespace

Vertices LandmarkShapeModel::points(const Eigen::VectorXd& coefficients) const {
  return as_vertices(mean + basis * coefficients);
}

LandmarkShapeModel landmark_shape_model(const std::vector<Observation>& seen, const PcaModel& shape, int modes,
                                        const PcaModel* expression) {
  const Eigen::Index available = shape.mode_count();
  const Eigen::Index shape_modes = modes < 0 ? available : std::min<Eigen::Index>(modes, available);
  const Eigen::Index expression_modes = expression ? expression->mode_count() : 0;
  LandmarkShapeModel out;
  out.mean.resize(3 * static_cast<Eigen::Index>(seen.size()));
  out.basis.resize(out.mean.size(), shape_modes + expression_modes);
  const auto scaled_rows = [](const PcaModel& pca, Eigen::Index row, Eigen::Index count) -> Eigen::MatrixXd {
    return pca.basis.block(row, 0, 3, count) * pca.variances.head(count).cwiseSqrt().asDiagonal();
  };
  for (size_t k = 0; k < seen.size(); ++k) {
    const Eigen::Index to = 3 * static_cast<Eigen::Index>(k), from = 3 * Eigen::Index{seen[k].vertex};
    out.mean.segment<3>(to) = shape.mean.segment<3>(from);
    out.basis.block(to, 0, 3, shape_modes) = scaled_rows(shape, from, shape_modes);
    if (!expression) continue;
    out.mean.segment<3>(to) += expression->mean.segment<3>(from);
    out.basis.block(to, shape_modes, 3, expression_modes) = scaled_rows(*expression, from, expression_modes);
  }
  return out;
}

Eigen::VectorXd fit_shape(const LandmarkShapeModel& model, const std::vector<Observation>& seen,
                          const AffineCamera& camera, const std::vector<Information>& W, double lambda,
                          const Eigen::MatrixXd& nuisance) {
  if (!(lambda >= 0)) throw InvalidInput("fit_shape: expected lambda >= 0");
  const auto K = static_cast<Eigen::Index>(seen.size());
  Eigen::MatrixXd J(2 * K, model.basis.cols());
  Eigen::VectorXd r(2 * K);
  Eigen::MatrixXd N(2 * K, nuisance.cols());
  for (Eigen::Index k = 0; k < K; ++k) {
    const Eigen::Matrix2d root = square_root(W[static_cast<size_t>(k)]);
    J.middleRows<2>(2 * k) = root * camera.A * model.basis.middleRows<3>(3 * k);
    r.segment<2>(2 * k) = root * (seen[static_cast<size_t>(k)].pixel - camera.project(model.mean.segment<3>(3 * k)));
    if (N.cols() > 0) N.middleRows<2>(2 * k) = root * nuisance.middleRows<2>(2 * k);
  }
  if (N.cols() > 0) {
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(N);
    const Eigen::MatrixXd Q = qr.householderQ() * Eigen::MatrixXd::Identity(N.rows(), qr.rank());
    J -= Q * (Q.transpose() * J);
    r -= Q * (Q.transpose() * r);
  }
  if (lambda == 0) return Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(J).solve(r);
  Eigen::MatrixXd H = J.transpose() * J;
  H.diagonal().array() += lambda;
  return H.llt().solve(J.transpose() * r);
}

}  // namespace facewright
