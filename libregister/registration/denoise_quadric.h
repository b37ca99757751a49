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
  double unit_, per_unit_;
  int count_ = 0;
  std::array<double, 15> moments_{};  // sums of w u^a v^b, by a + b and then by b
  double square_ = 0;                 // sum of w h^2
  std::array<double, 6> right_{};     // sums of w h times 1, u, v, u^2, uv, v^2
};

// Here, to be inlined: a scan adds some four million points.
inline void LocalQuadric::add(const Eigen::Vector3d& point, double w) {
  const Eigen::Vector3d d = (point - origin_) * per_unit_;
  const double u = d.dot(t1_), v = d.dot(t2_), h = d.dot(normal_);
  const double uu = u * u, uv = u * v, vv = v * v, wuu = w * uu, wuv = w * uv, wvv = w * vv, wh = w * h;
  const double terms[15] = {w,       w * u,   w * v,    wuu,      wuv,      wvv,      wuu * u, wuu * v,
                            wvv * u, wvv * v, wuu * uu, wuu * uv, wuu * vv, wuv * vv, wvv * vv};
  for (size_t k = 0; k < 15; ++k) moments_[k] += terms[k];
  const double rights[6] = {wh, wh * u, wh * v, wh * uu, wh * uv, wh * vv};
  for (size_t k = 0; k < 6; ++k) right_[k] += rights[k];
  square_ += wh * h;
  ++count_;
}

}  // namespace facewright
