// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

#include "libmodel/core/landmarks.h"

namespace facewright {

/// The mean head of young adults as a smooth implicit surface: < 0 inside, > 0 outside, about the distance in
/// millimetres near the surface (gradient length 0.7 .. 1.3 there). Exactly symmetric in x. Proportions after
/// [farkas1994, farkas2005]; drawn by us. Head frame: +x the subject's left, +y up, +z out of the face; y = 0 at the
/// eyes' height, z = 0 half way between the front of the eyes and the ear openings. Cost: about a microsecond.
double mean_head_distance(const Eigen::Vector3d& p);

/// Gradient of mean_head_distance by central differences, (3).
Eigen::Vector3d mean_head_gradient(const Eigen::Vector3d& p, double step = 0.05);

/// Moves p along the gradient onto the zero set.
Eigen::Vector3d project_to_mean_head(const Eigen::Vector3d& p);

/// Landmarks on the mean head, on its surface within 1e-6 mm and mirrored exactly: the ibug-68 points "1".."68"
/// [sagonas2016] and named extras (see docs/synthetic.md).
Landmarks mean_head_landmarks();

}  // namespace facewright
