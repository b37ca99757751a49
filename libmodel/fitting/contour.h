// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/camera.h"
#include "libmodel/core/topology.h"
#include "libmodel/fitting/affine_camera.h"
#include "libmodel/model/morphable_model.h"

namespace facewright {

struct ContourOptions {
  int level = 0;                 ///< model level whose outline is used: the coarsest; levels share their vertices
  int rounds = 5;                ///< rounds of the fit that match anew; from then on the matches stay
  bool only_contours = false;    ///< only vertices of the model's contour regions
  double largest_distance = 20;  ///< mm on the face between a landmark and its match, > 0
  int depth_resolution = 96;     ///< pixels of the z-buffer along the face's longer side
  double depth_bias = 2;         ///< mm by which a vertex may lie behind the surface seen around it
};

/// A vertex on the outline of the posed face.
struct OutlinePoint {
  int vertex = -1;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();  ///< across the outline in the image, unit length
};

/// Visible vertices of occluding edges, in vertex order: edges whose two triangles face to and from the camera (sign
/// change of n . view; edges of the mesh's border are none), ends not hidden in a z-buffer of the front faces. V (N x
/// 3) mm, F (M x 3), E = edges(F). O(N + M).
std::vector<OutlinePoint> visible_outline(const Vertices& V, const Faces& F, const std::vector<Edge>& E,
                                          const AffineCamera& camera, const ContourOptions& options = {});

/// Where on the outline landmarks are looked for.
struct OutlineSearch {
  Pixels landmarks = {};  ///< (K x 2); none: everywhere
  double reach_px = 0;    ///< only vertices at most that far from one of them
};

/// The outline that jaw landmarks are marked on: the visible occluding vertices and those vertices of the model's
/// contours (`contours`, lines of vertices between ear and chin) that are visible. Occluding here: a vertex with
/// triangles to and from the camera, which takes no edge topology. O(N + M).
std::vector<OutlinePoint> jaw_outline(const Vertices& V, const Faces& F, const FaceContours& contours,
                                      const AffineCamera& camera, const ContourOptions& options = {},
                                      const OutlineSearch& search = {});

/// For each of the pixels (K x 2) the index of its outline point, or -1: nearest pairs first, one to one, none farther
/// than `largest_px`. Ties go to the lower indices. O(K n log(K n)).
std::vector<int> match_outline(const Pixels& pixels, const std::vector<OutlinePoint>& outline, double largest_px);

}  // namespace facewright
