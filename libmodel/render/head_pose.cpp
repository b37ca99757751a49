// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/head_pose.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace facewright {

Eigen::Matrix3d rotation(const HeadPose& pose) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  return (AngleAxisd(pose.yaw, Vector3d::UnitY()) * AngleAxisd(pose.pitch, Vector3d::UnitX()) *
          AngleAxisd(pose.roll, Vector3d::UnitZ()))
      .toRotationMatrix();
}

HeadPose head_pose(const Eigen::Matrix3d& R) {
  // R(1,2) = -sin(pitch), R(0,2) = sin(yaw) cos(pitch), R(1,0) = cos(pitch) sin(roll).
  HeadPose pose;
  pose.pitch = std::asin(std::clamp(-R(1, 2), -1.0, 1.0));
  if (std::abs(R(1, 2)) > 1 - 1e-12) {
    pose.yaw = std::atan2(-R(2, 0), R(0, 0));
    return pose;
  }
  pose.yaw = std::atan2(R(0, 2), R(2, 2));
  pose.roll = std::atan2(R(1, 0), R(1, 1));
  return pose;
}

}  // namespace facewright
