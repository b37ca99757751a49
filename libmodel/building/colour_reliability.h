// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/surface/nearest.h"

namespace facewright {

/// Every pair is a ramp from trusted (weight 1) to useless (weight 0).
struct ColourReliabilityOptions {
  double near_mm = 0.75, far_mm = 3;          ///< mm to the place the colour is taken from
  double upright_deg = 40, grazing_deg = 75;  ///< degrees between the two normals there
  double least_border_mm = 1, border_mm = 3;  ///< mm from the scan's border: 0 at the first, 1 from the second on
  double least_stretch = 0.1, stretch = 0.5;  ///< area of a triangle's places over its own: 0 and 1
  double filled_edges = 4, widest_edges = 8;  ///< longest side of the scan's triangle over the median side: 1 and 0
};

/// How far a scan's colour at `places` (N), the nearest points of its surface to the registered vertices V (N x 3), can
/// be trusted as the colour of these vertices, (N) 0..1: the product of ramps over the distance, the angle of the
/// normals, the distance to the scan's border, the collapse of neighbouring vertices onto one place (which smears the
/// rim of a hole over it) and the size of the scan's triangle (holes that a scanner's software has bridged). O(N log
/// M).
Eigen::VectorXd colour_reliability(const Vertices& V, const Faces& F, const Mesh& scan,
                                   const std::vector<NearestPoint>& places,
                                   const ColourReliabilityOptions& options = {});

}  // namespace facewright
