// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "libmodel/core/landmarks.h"
#include "libregister/registration/symmetric_spline.h"

namespace facewright {

/// Unit tangents at the landmarks inside the curves of jaw, brows, lids and lips (ibug-68), from their neighbours along
/// the curve. Corners, the tip of the chin and the cupid's bow end curves and have none.
std::map<std::string, Eigen::Vector3d> landmark_curve_tangents(const Landmarks& landmarks);

/// Three data for a displacement that is `slide` times less certain along the tangent than across it. The spline moves
/// the point along the tangent as its least bending asks: the semi-landmarks of [gunz2005] without their iteration.
void add_semilandmark(const Eigen::Vector3d& point, const Eigen::Vector3d& displacement, const Eigen::Vector3d& tangent,
                      double stddev, double slide, std::vector<SplineDatum>* data);

}  // namespace facewright
