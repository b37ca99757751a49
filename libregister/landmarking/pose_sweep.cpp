// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/pose_sweep.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace facewright {
namespace {

double quantile(std::vector<double>& x, double q) {
  const auto at = x.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(x.size() - 1));
  std::nth_element(x.begin(), at, x.end());
  return *at;
}

}  // namespace

std::vector<Eigen::Matrix3d> cube_rotations() {
  std::vector<Eigen::Matrix3d> rotations;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      for (const double p : {1.0, -1.0})
        for (const double q : {1.0, -1.0}) {
          if (a == b) continue;
          const Eigen::Vector3d x = p * Eigen::Vector3d::Unit(a), y = q * Eigen::Vector3d::Unit(b);
          Eigen::Matrix3d R;
          R << x, y, x.cross(y);
          rotations.push_back(R);
        }
  return rotations;
}

Eigen::Matrix3d principal_axes(const Vertices& points) {
  const Eigen::RowVector3d middle = points.colwise().mean();
  const Vertices centred = points.rowwise() - middle;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(Eigen::Matrix3d(centred.transpose() * centred));
  Eigen::Matrix3d axes = solver.eigenvectors().rowwise().reverse();
  if (axes.determinant() < 0) axes.col(2) *= -1;
  return axes;
}

std::vector<Similarity> swept_poses(const Vertices& points, const Vertices& normals,
                                    const Eigen::Matrix3d& scan_from_head, const Eigen::Vector3d& nose) {
  constexpr double kStep = 25, kSlab = 15, kMiddle = 15;  // mm
  const Vertices X = points * scan_from_head, N = normals * scan_from_head;
  const double low = X.col(1).minCoeff(), high = X.col(1).maxCoeff();
  std::vector<Similarity> poses;
  for (double y = low + kStep; y < high - kStep; y += kStep) {
    std::vector<double> x, z;
    for (Eigen::Index i = 0; i < X.rows(); ++i)
      if (std::abs(X(i, 1) - y) < kSlab && N(i, 2) > 0) x.push_back(X(i, 0));
    if (x.size() < 20) continue;
    const double middle = (quantile(x, 0.05) + quantile(x, 0.95)) / 2;
    for (Eigen::Index i = 0; i < X.rows(); ++i)
      if (std::abs(X(i, 1) - y) < kSlab && N(i, 2) > 0 && std::abs(X(i, 0) - middle) < kMiddle) z.push_back(X(i, 2));
    if (z.empty()) continue;
    Similarity S;
    S.R = scan_from_head;
    S.t = scan_from_head * (Eigen::Vector3d(middle, y, quantile(z, 0.95)) - nose);
    poses.push_back(S);
  }
  return poses;
}

}  // namespace facewright
