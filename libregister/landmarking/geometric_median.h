// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace facewright {

/// The point with the least sum of distances to the given ones, by Weiszfeld's iteration; the mean of none is zero.
/// [weiszfeld1937]
Eigen::Vector3d geometric_median(const std::vector<Eigen::Vector3d>& points);

}  // namespace facewright
