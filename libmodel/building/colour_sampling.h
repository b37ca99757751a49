// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/image.h"
#include "libmodel/core/mesh.h"
#include "libmodel/surface/nearest.h"

namespace facewright {

/// A scan's colour at points on its surface, (P x 3) linear RGB; empty if the scan has neither texture nor vertex
/// colours. With a texture the colour is averaged over a disc of `footprint` (P) millimetres about each point (seven
/// taps, linear light), so that fine texture does not alias; vertex colours are interpolated. Cost O(P).
Colours sample_colours(const Mesh& scan, const Image& texture, const std::vector<NearestPoint>& points,
                       const Eigen::VectorXd& footprint);

}  // namespace facewright
