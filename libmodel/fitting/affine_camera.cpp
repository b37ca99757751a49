// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/affine_camera.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <string>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

void check(const Vertices& X, const Pixels& x) {
  if (X.rows() != x.rows())
    throw InvalidInput("camera: " + std::to_string(X.rows()) + " model points for " + std::to_string(x.rows()) +
                       " image points");
  if (X.rows() < 4)
    throw InvalidInput("camera: expected at least 4 landmarks, got " + std::to_string(X.rows()) +
                       "; mark more landmarks that the model has");
  if (!X.allFinite() || !x.allFinite()) throw InvalidInput("camera: a landmark is not finite");
}

/// Sums over the centred points: the normal equations fall apart into 3 x 3 and the centroid.
struct Scatter {
  Eigen::Matrix3d XX = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> Xx = Eigen::Matrix<double, 3, 2>::Zero();
};

template <typename Residual>
Scatter scatter(const Vertices& X, const Eigen::Vector3d& centre, const Residual& residual) {
  Scatter sum;
  for (Eigen::Index k = 0; k < X.rows(); ++k) {
    const Eigen::Vector3d d = X.row(k).transpose() - centre;
    const Eigen::Vector2d r = residual(k, d);
    sum.XX += d * d.transpose();
    sum.Xx += d * r.transpose();
  }
  return sum;
}

}  // namespace

AffineCameraResult estimate_affine_camera(const Vertices& X, const Pixels& x) {
  check(X, x);
  const Eigen::Vector3d X_mean = X.colwise().mean();
  const Eigen::Vector2d x_mean = x.colwise().mean();
  const Scatter sum = scatter(X, X_mean, [&](Eigen::Index k, const Eigen::Vector3d&) -> Eigen::Vector2d {
    return x.row(k).transpose() - x_mean;
  });
  // The normalisation of algorithm 7.2 (centroid 0, one scale) changes neither the solution nor this condition.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(sum.XX);
  const Eigen::Vector3d spread = eigen.eigenvalues();
  AffineCameraResult result;
  result.summary.condition = spread[0] > 0 ? std::sqrt(spread[2] / spread[0]) : std::numeric_limits<double>::infinity();
  if (!(result.summary.condition < 1e6))
    throw InvalidInput(
        "camera: the landmarks lie in a plane of the model, so the pose is undetermined; "
        "add landmarks of other depth, such as the nose tip");
  const auto solve = [&](const Eigen::Matrix<double, 3, 2>& Xx) -> Eigen::Matrix<double, 3, 2> {
    return eigen.eigenvectors() * spread.cwiseInverse().asDiagonal() * (eigen.eigenvectors().transpose() * Xx);
  };
  Eigen::Matrix<double, 3, 2> P = solve(sum.Xx);
  // Normal equations square the condition; solving for what is left gives the digits back.
  P += solve(scatter(X, X_mean, [&](Eigen::Index k, const Eigen::Vector3d& d) -> Eigen::Vector2d {
               return x.row(k).transpose() - x_mean - P.transpose() * d;
             }).Xx);
  result.camera.A = P.transpose();
  result.camera.b = x_mean - result.camera.A * X_mean;
  result.summary.points = static_cast<int>(X.rows());
  double squares = 0;
  for (Eigen::Index k = 0; k < X.rows(); ++k)
    squares += (result.camera.project(X.row(k).transpose()) - x.row(k).transpose()).squaredNorm();
  result.summary.rms_px = std::sqrt(squares / static_cast<double>(X.rows()));
  return result;
}

Eigen::MatrixXd pixel_derivative(const Vertices& X) {
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(2 * X.rows(), 8);
  for (Eigen::Index k = 0; k < X.rows(); ++k) {
    J.block<1, 4>(2 * k, 0) << X.row(k), 1;
    J.block<1, 4>(2 * k + 1, 4) << X.row(k), 1;
  }
  return J;
}

}  // namespace facewright
