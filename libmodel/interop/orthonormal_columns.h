// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

namespace facewright {

/// Whether B'(B r) = r for one r without zeros, to 1e-3: float32 leaves 1e-5, a scaled or cut basis more than 0.1. O(3N
/// K).
template <class Scalar>
bool has_orthonormal_columns(const Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& B) {
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  if (B.cols() == 0) return true;
  Vector r = Vector::LinSpaced(B.cols(), Scalar(0.5), Scalar(1.5));
  for (Eigen::Index k = 1; k < B.cols(); k += 2) r[k] = -r[k];
  const Vector y = B * r;
  return (B.transpose() * y - r).cwiseAbs().maxCoeff() < Scalar(1e-3);
}

}  // namespace facewright
