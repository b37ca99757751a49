// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/orthographic_camera.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

/// The rotation whose first two rows are nearest to the unit vectors u, v: both move by the same angle towards or away
/// from each other until they are orthogonal (the polar factor in closed form).
Eigen::Matrix3d nearest_rotation(const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
  const Eigen::Vector3d p = (u + v).normalized(), q = (u - v).normalized();
  Eigen::Matrix3d R;
  R.row(0) = (p + q).normalized();
  R.row(1) = (p - q).normalized();
  R.row(2) = R.row(0).cross(R.row(1));
  return R;
}

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// Derivative of the pixel by (rotation vector, relative scale, shift), q = R X in camera axes.
Eigen::Matrix<double, 2, 6> jacobian(const OrthographicCamera& camera, const Eigen::Vector3d& q) {
  Eigen::Matrix<double, 2, 6> J;
  J << 0, q[2], -q[1], q[0], 1, 0,  //
      q[2], 0, -q[0], -q[1], 0, 1;
  J.leftCols<4>() *= camera.s;
  return J;
}

OrthographicCamera moved(const OrthographicCamera& camera, const Vector6& step) {
  OrthographicCamera out = camera;
  const double angle = step.head<3>().norm();
  if (angle > 0) {
    const Eigen::Matrix3d R = Eigen::AngleAxisd(angle, step.head<3>() / angle).toRotationMatrix() * camera.R;
    out.R = nearest_rotation(R.row(0), R.row(1));  // steps leave no rounding behind
  }
  out.s = camera.s * std::exp(std::clamp(step[3], -1.0, 1.0));
  out.t += step.tail<2>();
  return out;
}

}  // namespace

OrthographicCamera nearest_orthographic(const AffineCamera& camera) {
  const Eigen::Vector3d r1 = camera.A.row(0).transpose(), r2 = -camera.A.row(1).transpose();
  const double l1 = r1.norm(), l2 = r2.norm();
  if (!(l1 > 0) || !(l2 > 0))
    throw InvalidInput("camera: an affine camera without scale has no orthographic neighbour");
  if (!((r1 / l1).cross(r2 / l2).squaredNorm() > 1e-24))
    throw InvalidInput("camera: an affine camera with parallel rows has no orthographic neighbour");
  return {(l1 + l2) / 2, nearest_rotation(r1 / l1, r2 / l2), camera.b};
}

OrthographicCamera estimate_orthographic_camera(const Vertices& X, const Pixels& x) {
  return nearest_orthographic(estimate_affine_camera(X, x).camera);
}

Eigen::MatrixXd pixel_derivative(const OrthographicCamera& camera, const Vertices& X) {
  Eigen::MatrixXd J(2 * X.rows(), 6);
  for (Eigen::Index k = 0; k < X.rows(); ++k)
    J.middleRows<2>(2 * k) = jacobian(camera, camera.R * X.row(k).transpose());
  return J;
}

OrthographicResult refine_orthographic(const OrthographicCamera& start, const Vertices& X, const Pixels& x,
                                       const std::vector<Information>& W, const OrthographicOptions& options) {
  OrthographicResult result{start, {}};
  for (int i = 0; i < options.iterations && !result.summary.converged; ++i) {
    Eigen::Matrix<double, 6, 6> H = Eigen::Matrix<double, 6, 6>::Zero();
    Vector6 g = Vector6::Zero();
    for (Eigen::Index k = 0; k < X.rows(); ++k) {
      const Information& weight = W[static_cast<size_t>(k)];
      const Eigen::Vector3d q = result.camera.R * X.row(k).transpose();
      const Eigen::Vector2d r = x.row(k).transpose() - result.camera.t - result.camera.s * Eigen::Vector2d(q[0], -q[1]);
      const Eigen::Matrix<double, 2, 6> J = jacobian(result.camera, q), WJ = weight * J;
      H.noalias() += J.row(0).transpose() * WJ.row(0) + J.row(1).transpose() * WJ.row(1);
      g.noalias() += WJ.transpose() * r;
    }
    const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> solver(H);
    const Vector6 step = solver.solve(g);
    if (solver.info() != Eigen::Success || !step.allFinite() ||
        !(solver.vectorD().minCoeff() > 1e-18 * solver.vectorD().maxCoeff()))
      throw SolverError("camera: too few landmarks with weight to determine the pose");
    result.camera = moved(result.camera, step);
    result.summary.converged = step.head<4>().norm() < options.tolerance;
    ++result.summary.iterations;
  }
  double sum = 0;
  int count = 0;
  for (Eigen::Index k = 0; k < X.rows(); ++k) {
    if (W[static_cast<size_t>(k)].isZero(0)) continue;
    sum += (x.row(k).transpose() - result.camera.affine().project(X.row(k).transpose())).squaredNorm();
    ++count;
  }
  result.summary.rms_px = count > 0 ? std::sqrt(sum / count) : 0;
  return result;
}

}  // namespace facewright
