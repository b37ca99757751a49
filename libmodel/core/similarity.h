// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

#include "libmodel/core/mesh.h"

namespace facewright {

/// A similarity transform x -> s R x + t, named target_from_source where used.
struct Similarity {
  double s = 1;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return s * (R * x) + t; }
  /// c_from_a = c_from_b * b_from_a.
  Similarity operator*(const Similarity& other) const { return {s * other.s, R * other.R, s * (R * other.t) + t}; }
  Vertices apply(const Vertices& X) const { return ((s * X * R.transpose()).rowwise() + t.transpose()).eval(); }
  Similarity inverse() const { return {1 / s, R.transpose(), -(R.transpose() * t) / s}; }
};

enum class Scaling { fixed, free };

/// Weighted least-squares similarity (or rigid motion) that takes the rows of A to those of B, both (K x 3), K >= 3;
/// weights (K) >= 0. Throws InvalidInput for fewer points or points on a line. [umeyama1991]
Similarity fit_similarity(const Vertices& A, const Vertices& B, const Eigen::VectorXd& weights,
                          Scaling scaling = Scaling::free);
Similarity fit_similarity(const Vertices& A, const Vertices& B, Scaling scaling = Scaling::free);

}  // namespace facewright
