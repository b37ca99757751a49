// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "libmodel/core/mesh.h"

namespace facewright {

/// An affine camera: pixel = A x + b for x in model millimetres. Pixels: centre of the top-left pixel is (0, 0), y
/// down.
struct AffineCamera {
  Eigen::Matrix<double, 2, 3> A = Eigen::Matrix<double, 2, 3>::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();

  Eigen::Vector2d project(const Eigen::Vector3d& x) const { return A * x + b; }
  /// Unit vector towards the camera in model coordinates: the larger x . n, the nearer. It is n = (a1 x a2), reversed
  /// because pixel y runs down.
  Eigen::Vector3d towards_camera() const {
    const Eigen::Vector3d a1 = A.row(0), a2 = A.row(1);
    return -a1.cross(a2).normalized();
  }
};

/// Scaled orthographic: pixel = s * (R x).xy with y flipped, + t. R turns model into camera axes (+x right, +y up, +z
/// towards the viewer).
struct OrthographicCamera {
  double s = 1;  ///< pixels per millimetre
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector2d t = Eigen::Vector2d::Zero();

  AffineCamera affine() const {
    AffineCamera c;
    c.A.row(0) = s * R.row(0);
    c.A.row(1) = -s * R.row(1);
    c.b = t;
    return c;
  }
};

}  // namespace facewright
