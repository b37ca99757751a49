// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/mesh.h"

namespace facewright {

/// How a texture map deforms the surface. s1 >= s2 are the singular values of a triangle's map from surface to plane,
/// after scaling the map to the surface's area; 1 is perfect for all figures. [sander2001]
struct UvDistortion {
  double l2 = 0;                   ///< sqrt of the area-weighted mean of (1/s1^2 + 1/s2^2) / 2
  double linf = 0;                 ///< largest 1/s2
  double conformal = 0;            ///< area-weighted mean of (s1/s2 + s2/s1) / 2
  double area = 0;                 ///< area-weighted mean of (s1 s2 + 1/(s1 s2)) / 2
  double symmetric_dirichlet = 0;  ///< area-weighted mean of (s1^2 + s2^2 + 1/s1^2 + 1/s2^2) / 4
  int flips = 0;                   ///< triangles turned over or flat in the plane; left out of the figures above
};

/// uv (N x 2), one per vertex. O(M).
UvDistortion measure_distortion(const Vertices& V, const Faces& F, const TexCoords& uv);

/// Twice the signed area of every triangle in the plane, (M).
Eigen::VectorXd signed_areas(const TexCoords& uv, const Faces& F);

/// Share of the covered pixels of a `size` x `size` image over [0,1]^2 whose centre lies in more than one triangle: 0
/// if the map is one to one.
double overlap_share(const TexCoords& uv, const Faces& F, int size = 1024);

}  // namespace facewright
