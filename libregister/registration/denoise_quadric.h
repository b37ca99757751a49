// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <array>

namespace facewright {

/// Weighted least squares of h = c0 + c1 u + c2 v + c3 u^2 + c4 uv + c5 v^2 about a point and along a normal. Points
/// are added one by one; solving does not end the adding, so that windows can grow.
class LocalQuadric {
 public:
  /// `unit` in mm scales the coordinates; about the size of the window.
  LocalQuadric(const Eigen::Vector3d& origin, const Eigen::Vector3d& normal, double unit);

  void add(const Eigen::Vector3d& point, double weight);

  struct Value {
    double height = 0;    ///< mm, of the quadric above the origin
    double variance = 0;  ///< of that height for points of variance 1 and weights near 1
    double residual = 0;  ///< weighted sum of the squared residuals, mm^2
    double freedom = 0;   ///< sum of the weights less the six coefficients
    bool valid = false;
  };
  Value at_origin() const;
  int count() const { return count_; }

 private:
  Eigen::Vector3d origin_, normal_, t1_, t2_;
  double unit_;
  int count_ = 0;
  std::array<double, 15> moments_{};  // sums of w u^a v^b, by a + b and then by b
  double square_ = 0;                 // sum of w h^2
  std::array<double, 6> right_{};     // sums of w h times 1, u, v, u^2, uv, v^2
};

}  // namespace facewright
