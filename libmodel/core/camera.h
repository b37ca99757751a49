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

/// A pinhole camera: q = R x + t in camera axes (+x right, +y up, +z towards the viewer, the camera at the origin
/// looking along -z, so that what it sees has q.z < 0); pixel = principal + focal_px * (q.x, -q.y) / depth. No lens
/// distortion, square pixels.
struct PerspectiveCamera {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d(0, 0, -1000);     ///< mm
  double focal_px = 1000;                               ///< focal length, pixels
  Eigen::Vector2d principal = Eigen::Vector2d::Zero();  ///< where the optical axis meets the image, pixels

  Eigen::Vector3d in_camera(const Eigen::Vector3d& x) const { return R * x + t; }
  /// Distance along the optical axis, mm; a point is seen if it is positive.
  double depth(const Eigen::Vector3d& x) const { return -in_camera(x)[2]; }
  Eigen::Vector2d project(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d q = in_camera(x);
    return principal - focal_px / q[2] * Eigen::Vector2d(q[0], -q[1]);
  }
  /// Unit vector from x towards the camera, model coordinates.
  Eigen::Vector3d towards_camera(const Eigen::Vector3d& x) const {
    return -(R.transpose() * in_camera(x)).normalized();
  }
  /// The affine camera that agrees at x to first order.
  AffineCamera affine_at(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d q = in_camera(x);
    const double d = -q[2];
    Eigen::Matrix<double, 2, 3> J;
    J << 1, 0, q[0] / d, 0, -1, -q[1] / d;
    AffineCamera c;
    c.A = focal_px / d * J * R;
    c.b = project(x) - c.A * x;
    return c;
  }
};

}  // namespace facewright
