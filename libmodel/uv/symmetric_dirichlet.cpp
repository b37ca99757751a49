// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/uv/symmetric_dirichlet.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>

namespace facewright {
namespace {

// The columns p, q of the map's Jacobian, as (p_u, p_v, q_u, q_v).
Eigen::Vector4d jacobian(const RestTriangle& t, const Eigen::Matrix<double, 3, 2>& corners) {
  const Eigen::RowVector2d u1 = corners.row(1) - corners.row(0), u2 = corners.row(2) - corners.row(0);
  Eigen::Vector4d j;
  j.head<2>() = u1 / t.x1;
  j.tail<2>() = (u2.transpose() - t.x2 * j.head<2>()) / t.y2;
  return j;
}

double determinant(const Eigen::Vector4d& j) { return j[0] * j[3] - j[1] * j[2]; }

Eigen::Matrix4d without_negative_curvature(const Eigen::Matrix4d& H) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(H);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace

RestTriangle rest_triangle(const Eigen::Vector3d& e1, const Eigen::Vector3d& e2, double least_area) {
  const double length = e1.norm(), twice = e1.cross(e2).norm();
  if (!(twice > 2 * least_area)) {
    const double side = std::sqrt(4 * least_area / std::sqrt(3.0));
    return {side, 0.5 * side, std::sqrt(0.75) * side, 1};
  }
  return {length, e1.dot(e2) / length, twice / length, 1};
}

double symmetric_dirichlet(const RestTriangle& t, const Eigen::Matrix<double, 3, 2>& corners) {
  const Eigen::Vector4d j = jacobian(t, corners);
  const double d = determinant(j);
  if (!(d > 0)) return std::numeric_limits<double>::infinity();
  return 0.25 * j.squaredNorm() * (1 + 1 / (d * d)) - 1;
}

DirichletTerms symmetric_dirichlet_terms(const RestTriangle& t, const Eigen::Matrix<double, 3, 2>& corners) {
  const Eigen::Vector4d j = jacobian(t, corners), by_d(j[3], -j[2], -j[1], j[0]);
  const double T = j.squaredNorm(), d = determinant(j), d2 = d * d, d3 = d2 * d;
  const Eigen::Vector4d g = 0.25 * (2 * (1 + 1 / d2) * j - 2 * T / d3 * by_d);
  Eigen::Matrix4d H = 2 * (1 + 1 / d2) * Eigen::Matrix4d::Identity();
  H -= 4 / d3 * (j * by_d.transpose() + by_d * j.transpose());
  H += 6 * T / (d2 * d2) * by_d * by_d.transpose();
  H(0, 3) -= 2 * T / d3, H(3, 0) -= 2 * T / d3;
  H(1, 2) += 2 * T / d3, H(2, 1) += 2 * T / d3;
  // How the columns of the Jacobian follow from the corners.
  const double s = t.x2 / (t.x1 * t.y2);
  Eigen::Matrix<double, 4, 6> G = Eigen::Matrix<double, 4, 6>::Zero();
  for (int k = 0; k < 2; ++k) {
    G(k, k) = -1 / t.x1, G(k, 2 + k) = 1 / t.x1;
    G(2 + k, k) = s - 1 / t.y2, G(2 + k, 2 + k) = -s, G(2 + k, 4 + k) = 1 / t.y2;
  }
  return {G.transpose() * g, 0.25 * G.transpose() * without_negative_curvature(H) * G};
}

}  // namespace facewright
