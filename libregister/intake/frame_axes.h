// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <string>

namespace facewright {

/// A direction of a file's coordinates.
enum class FileAxis { automatic, plus_x, minus_x, plus_y, minus_y, plus_z, minus_z };

/// "auto", "x", "+x", "-x", "y", ...; throws InvalidInput.
FileAxis file_axis_from_name(const std::string& name);
/// "x", "-x", ...
std::string file_axis_name(FileAxis axis);
/// Unit vector; zero for automatic.
Eigen::Vector3d file_axis_vector(FileAxis axis);
/// The axis nearest to a direction.
FileAxis nearest_file_axis(const Eigen::Vector3d& direction);

/// Of the 24 rotations that take axes to axes the one nearest to R.
Eigen::Matrix3d nearest_axis_rotation(const Eigen::Matrix3d& R);

}  // namespace facewright
