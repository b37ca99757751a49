// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/frame_axes.h"

#include <Eigen/Geometry>

#include "libmodel/core/errors.h"

namespace facewright {

FileAxis file_axis_from_name(const std::string& name) {
  if (name == "auto") return FileAxis::automatic;
  const bool minus = !name.empty() && name[0] == '-';
  const std::string letter = !name.empty() && (name[0] == '-' || name[0] == '+') ? name.substr(1) : name;
  if (letter == "x") return minus ? FileAxis::minus_x : FileAxis::plus_x;
  if (letter == "y") return minus ? FileAxis::minus_y : FileAxis::plus_y;
  if (letter == "z") return minus ? FileAxis::minus_z : FileAxis::plus_z;
  throw InvalidInput("axis: expected auto, x, -x, y, -y, z or -z, got '" + name + "'");
}

std::string file_axis_name(FileAxis axis) {
  static const char* const names[] = {"auto", "x", "-x", "y", "-y", "z", "-z"};
  return names[static_cast<int>(axis)];
}

Eigen::Vector3d file_axis_vector(FileAxis axis) {
  if (axis == FileAxis::automatic) return Eigen::Vector3d::Zero();
  const int i = static_cast<int>(axis) - 1;
  return (i % 2 == 0 ? 1 : -1) * Eigen::Vector3d::Unit(i / 2);
}

FileAxis nearest_file_axis(const Eigen::Vector3d& direction) {
  Eigen::Index k = 0;
  direction.cwiseAbs().maxCoeff(&k);
  return static_cast<FileAxis>(1 + 2 * static_cast<int>(k) + (direction[k] < 0 ? 1 : 0));
}

Eigen::Matrix3d nearest_axis_rotation(const Eigen::Matrix3d& R) {
  Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
  double most = -4;
  for (int up = 0; up < 6; ++up)
    for (int front = 0; front < 6; ++front) {
      if (up / 2 == front / 2) continue;
      Eigen::Matrix3d Q;
      Q.col(1) = file_axis_vector(static_cast<FileAxis>(1 + up));
      Q.col(2) = file_axis_vector(static_cast<FileAxis>(1 + front));
      Q.col(0) = Q.col(1).cross(Q.col(2));
      const double agreement = (Q.transpose() * R).trace();
      if (agreement > most) most = agreement, best = Q;
    }
  return best;
}

}  // namespace facewright
