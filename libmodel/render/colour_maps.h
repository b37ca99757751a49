// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

#include "libmodel/core/mesh.h"

namespace facewright {

/// Signed values (N) as linear RGB (N x 3): blue at -range, near-white at 0, red at +range, clamped; NaN is grey. A
/// fixed range makes pictures comparable. Throws InvalidInput unless range > 0.
Colours diverging_colours(const Eigen::VectorXd& values, double range);

/// Values from 0 to range, dark to light (near-black, violet, orange, pale yellow), monotonic in lightness; NaN is
/// grey.
Colours sequential_colours(const Eigen::VectorXd& values, double range);

}  // namespace facewright
