// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

// Private to this module: what the geometry of a mean face says about its units, axes and winding.

/// Height (y extent) in units of the file.
double face_height(const Vertices& V);
/// Millimetres per "um", "mm", "cm", "m".
double millimetres_per(const std::string& unit);
/// Units in which the height is that of a face or head, 120 to 350 mm; they are factors of ten apart, so one at most.
std::string plausible_unit(double height);

/// -1..1: how far triangles point away from the middle of the vertices; clearly positive for outward ones.
double outwardness(const Vertices& V, const Faces& F);

/// Mean normal by area: of length 0 for a closed surface, about 0.5 to 0.9 for an open face, along where it looks.
Eigen::Vector3d mean_normal(const Vertices& V, const Faces& F);

/// "x z -y": the rotation that makes the named axes of a file ours (left, up, out of the face). Throws InvalidInput for
/// text that names no rotation.
Eigen::Matrix3d axes_rotation(const std::string& axes);
/// Every point of an interleaved 3N vector, or of each column, rotated.
void rotate_points(Eigen::Ref<Eigen::MatrixXd> columns, const Eigen::Matrix3d& rotation);

}  // namespace facewright
