// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/uv/distortion.h"

namespace facewright {

struct IsomapOptions {
  int landmark_count = 0;  ///< vertices whose distances are computed [desilva2004]; >= N: all [tenenbaum2000]; 0: all
                           ///< up to 1200 vertices, 300 above
  double margin = 0.01;           ///< free border of the unit square
  int repair_sweeps = 20;         ///< of vertex moves, before the map is solved anew
  double stretch_weight = 0.002;  ///< of the stretch against squared stress, > 0 (docs/uv.md)
  int iterations = 500;           ///< at most, of lowering stress and stretch; 0 = the isomap as it is
  int threads = 0;                ///< 0 = all
};

struct IsomapSummary {
  int source_count = 0;               ///< vertices whose distances entered the scaling
  int computed_count = 0;             ///< of those, computed; the others follow by symmetry
  double third_eigenvalue_share = 0;  ///< lambda_3 / lambda_1; above 0.2 the surface does not flatten well
  double stress = 0;  ///< of the scaling: sqrt(sum (|uv_i - uv_j| - d_ij)^2 / sum d_ij^2) at the best uniform scale
  double final_stress = 0;  ///< the same of the result
  double asymmetry = 0;     ///< root mean square change by symmetrising, share of the map's size
  bool symmetric = false;   ///< the map is; false without a mirror, or if the triangles do not allow it
  int flips_before_repair = 0;
  std::string repair;  ///< the step of the ladder that made the map one to one
  int iterations = 0;
  std::string stop;  ///< of lowering stress and stretch
  UvDistortion distortion;
  double overlap = 0;   ///< share of the covered area that is covered twice
  double coverage = 0;  ///< share of the unit square that the map covers
  IsomapOptions options;
};

struct IsomapResult {
  TexCoords uv;  ///< (N x 2) in [margin, 1 - margin]^2, aspect kept, v up
  IsomapSummary summary;
};

/// Flattens a face so that distances in the plane are as near as can be to distances over the surface: exact geodesics
/// and classical multidimensional scaling (Isomap), then stress and stretch lowered together. Holes inside the outer
/// border are closed for the distances. The map is turned upright (head frame: +x to the right, +y up), made symmetric
/// if `mirror` (N) is given (empty: none), freed of flipped triangles and scaled uniformly into the unit square. Where
/// mirror and triangles are symmetric, so are the distances used. Meant for about a thousand vertices; finer levels
/// inherit (refine_field). Throws InvalidInput if the mesh is not one connected piece with a border.
IsomapResult isomap_uv(const Vertices& V, const Faces& F, const std::vector<int>& mirror,
                       const IsomapOptions& options = {});

}  // namespace facewright
