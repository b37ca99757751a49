// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/thin_plate_spline.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

double mean_distance(const Vertices& X) {
  double sum = 0;
  for (Eigen::Index i = 0; i < X.rows(); ++i)
    for (Eigen::Index j = 0; j < i; ++j) sum += (X.row(i) - X.row(j)).norm();
  return sum / (0.5 * static_cast<double>(X.rows()) * static_cast<double>(X.rows() - 1));
}

}  // namespace

double bend_weight(double distance, double radius) {
  const double t = std::clamp((2.5 * radius - distance) / radius, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

ThinPlateSpline::ThinPlateSpline(const Vertices& from, const Vertices& to, double lambda,
                                 const Eigen::VectorXd& relative_variance)
    : centres_(from), lambda_(lambda) {
  const Eigen::Index K = from.rows();
  if (K < 4 || to.rows() != K || relative_variance.size() != K)
    throw InvalidInput("thin-plate spline: needs at least 4 corresponding landmarks, got " + std::to_string(K));
  centre_ = from.colwise().mean();
  radius_ = (from.rowwise() - centre_).rowwise().norm().maxCoeff();
  scale_ = mean_distance(from);
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(K + 4, K + 4);
  for (Eigen::Index i = 0; i < K; ++i) {
    for (Eigen::Index j = 0; j < K; ++j) G(i, j) = -(from.row(i) - from.row(j)).norm() / scale_;
    G(i, i) += lambda * relative_variance[i];
    G(i, K) = G(K, i) = 1;
    G.block<1, 3>(i, K + 1) = (from.row(i) - centre_) / scale_;
    G.block<3, 1>(K + 1, i) = G.block<1, 3>(i, K + 1).transpose();
  }
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(G);
  if (!lu.isInvertible()) throw InvalidInput("thin-plate spline: the landmarks are coplanar or coincide");
  const Eigen::MatrixXd inverse = lu.inverse();
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(K + 4, 3);
  b.topRows(K) = to;
  const Eigen::MatrixXd x = inverse * b;
  coefficients_ = x.topRows(K);
  affine_ = x.bottomRows<4>();
  leave_one_out_.resize(K, 3);
  for (Eigen::Index k = 0; k < K; ++k) leave_one_out_.row(k) = x.row(k) / inverse(k, k);  // Rippa 1999, Eq. (11)
}

Vertices ThinPlateSpline::operator()(const Vertices& X) const {
  Vertices Y(X.rows(), 3);
  for (Eigen::Index i = 0; i < X.rows(); ++i) {
    const Eigen::RowVector3d x = X.row(i), d = x - centre_;
    Eigen::RowVector3d bend = Eigen::RowVector3d::Zero();
    const double weight = bend_weight(d.norm(), radius_);
    if (weight > 0)
      for (Eigen::Index k = 0; k < centres_.rows(); ++k)
        bend -= (x - centres_.row(k)).norm() / scale_ * coefficients_.row(k);
    Y.row(i) = weight * bend + affine_.row(0) + d / scale_ * affine_.bottomRows<3>();
  }
  return Y;
}

ThinPlateSpline fit_thin_plate_spline(const Vertices& from, const Vertices& to,
                                      const Eigen::VectorXd& relative_variance, double least_lambda,
                                      double standard_errors) {
  constexpr int kSteps = 16;  // logspace(-4, 1): a finer grid changes the residual by less than 1 %
  const auto K = static_cast<double>(from.rows());
  std::vector<ThinPlateSpline> splines;
  std::vector<double> costs;
  double bound = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double lambda = std::pow(10.0, -4 + 5.0 * i / (kSteps - 1));
    if (lambda < least_lambda && i + 1 < kSteps) continue;
    splines.emplace_back(from, to, lambda, relative_variance);
    const Eigen::ArrayXd e2 =
        splines.back().leave_one_out().rowwise().squaredNorm().array() / relative_variance.array();
    const bool best = costs.empty() || e2.mean() < *std::min_element(costs.begin(), costs.end());
    costs.push_back(e2.mean());
    // So many standard errors of the mean above the least: what the data cannot tell from the optimum.
    if (best) bound = e2.mean() + standard_errors * std::sqrt((e2 - e2.mean()).square().sum() / (K - 1) / K);
  }
  size_t chosen = splines.size();
  while (costs[--chosen] > bound) {
  }
  return splines[chosen];
}

}  // namespace facewright
