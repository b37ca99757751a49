// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

namespace facewright::face_design {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// The mean head with its nostrils closed by a sheet: what the reference face lies on. Signed, mm.
double distance(const Vector3d& p);
/// True where the surface is the sheet over a nostril.
bool on_nostril_sheet(const Vector3d& p);
Vector3d normal(const Vector3d& p);
/// Nearest point of the surface, to first order; p must be within a few millimetres.
Vector3d project(const Vector3d& p);
/// Outermost surface point on the ray through the chart point q.
Vector3d lift(const Vector2d& q);
/// Chart of the face: azimuthal-equidistant directions (radians) from a point inside the head from which the whole
/// face, underside of nose and jaw included, can be seen.
Vector2d chart(const Vector3d& p);
/// Foremost surface point over (x, y).
Vector3d front(double x, double y);

}  // namespace facewright::face_design
