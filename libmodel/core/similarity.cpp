// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/core/similarity.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <string>

#include "libmodel/core/errors.h"

namespace facewright {

Similarity fit_similarity(const Vertices& A, const Vertices& B, const Eigen::VectorXd& weights, Scaling scaling) {
  if (A.rows() != B.rows() || weights.size() != A.rows() || A.rows() < 3)
    throw InvalidInput("similarity: needs at least 3 corresponding points, got " + std::to_string(A.rows()) + " and " +
                       std::to_string(B.rows()));
  const double total = weights.sum();
  if (!(total > 0)) throw InvalidInput("similarity: all weights are zero");
  const Eigen::RowVector3d a0 = weights.transpose() * A / total, b0 = weights.transpose() * B / total;
  const Vertices a = A.rowwise() - a0, b = B.rowwise() - b0;
  const Eigen::Matrix3d H = b.transpose() * weights.asDiagonal() * a;  // Eq. (38), up to the factor 1/total
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d d = svd.singularValues();
  if (!(d[1] > 1e-12 * d[0])) throw InvalidInput("similarity: the points lie on a line");
  Eigen::Vector3d sign(1, 1, svd.matrixU().determinant() * svd.matrixV().determinant() < 0 ? -1 : 1);
  Similarity S;
  S.R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  if (scaling == Scaling::free) S.s = d.dot(sign) / (weights.array() * a.rowwise().squaredNorm().array()).sum();
  S.t = b0.transpose() - S.s * (S.R * a0.transpose());
  return S;
}

Similarity fit_similarity(const Vertices& A, const Vertices& B, Scaling scaling) {
  return fit_similarity(A, B, Eigen::VectorXd::Ones(A.rows()), scaling);
}

}  // namespace facewright
