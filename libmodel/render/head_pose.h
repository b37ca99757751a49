// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

namespace facewright {

/// Head orientation in radians, R = Ry(yaw) Rx(pitch) Rz(roll) from head to camera axes: the head rolls first, turns
/// last. yaw > 0: the subject looks to their left (right in the image); pitch > 0: down; roll > 0: the head tilts
/// towards the subject's right shoulder, that is counter-clockwise in the image.
struct HeadPose {
  double yaw = 0, pitch = 0, roll = 0;
};

Eigen::Matrix3d rotation(const HeadPose& pose);
/// The inverse, with pitch in [-pi/2, pi/2]; at |pitch| = pi/2 roll is 0.
HeadPose head_pose(const Eigen::Matrix3d& R);

}  // namespace facewright
