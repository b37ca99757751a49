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
/// colours. It is averaged in linear light over a disc of `footprint` (P) millimetres about each point, so that neither
/// fine texture nor dense vertices alias: over rings of bilinear taps 1.5 texels apart, or over the vertices in the
/// disc by their areas; where the disc is smaller than a texel or a triangle the colour is interpolated. Throws
/// InvalidInput unless there is a footprint per point. O(P) times the texels or vertices in a disc, at most 1800.
Colours sample_colours(const Mesh& scan, const Image& texture, const std::vector<NearestPoint>& points,
                       const Eigen::VectorXd& footprint);

}  // namespace facewright
