// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// A subdivided mesh and its left-right table (empty without symmetry).
struct SmoothSurface {
  Vertices V;  ///< (N x 3)
  Faces F;     ///< (M x 3)
  std::vector<int> mirror;
};

/// The smoothing (approximating) mode of 4-8 subdivision (velho2001): `steps` >= 0 uniform steps from the longest-edge
/// pairing, the same triangles as in the interpolating mode, with the masks of the four-directional box spline:
///   new vertex, centre of a block of four corners    1/4 of each        (of a single triangle: 1/3 of each)
///   old vertex with k edges that are no diagonals    1/2 v + 1/(2k) of each neighbour along them
///   new vertex on a border edge                      1/2 of each end
///   old vertex on a border whose edges are split     3/4 v + 1/8 of each neighbour along the border
/// The surface is C4 except at extraordinary vertices, where it is C1; its border is a cubic spline that depends on the
/// border alone. The vertices do not stay where they are: for drawing and for making references, not for
/// registration. Limit surfaces follow a smooth surface that the base mesh samples to second order in its edge length.
/// Throws InvalidInput as pair_triangles does.
SmoothSurface smooth_surface(const Mesh& base, int steps, const std::vector<int>& mirror = {});

}  // namespace facewright
