// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"
#include "libmodel/core/similarity.h"

namespace facewright {

/// A registered face made symmetric, and the frame in which it is.
struct SymmetricFace {
  Vertices V;                 ///< (N x 3) mirror partners agree exactly, midline vertices have x = 0; mm
  Similarity head_from_scan;  ///< rigid: scale 1
  double rms = 0;             ///< mm, from the registered vertices to their symmetric places, weighted
};

/// The mean of a registered face (N x 3) and its mirror image, in a head frame: rigid alignment to the reference
/// shape `neutral` (N x 3, symmetric about x = 0), then to the symmetric face itself until it rests, so that the plane
/// is the registered face's own. `mirror` (N) is the left-right table, `weights` (N) >= 0 say how far each vertex is
/// to be trusted. Throws InvalidInput if sizes differ or there is no mirror table.
SymmetricFace symmetrise(const Vertices& registered, const Vertices& neutral, const std::vector<int>& mirror,
                         const Eigen::VectorXd& weights);

/// The landmarks (already in the head frame) made symmetric: a pair becomes the mean of one and the other's mirror
/// image, midline points move onto x = 0. A landmark without its partner stays where it is and its partner is added.
Landmarks symmetrise(const Landmarks& landmarks);

/// True for landmarks on the midline: their own mirror image by name, and nearer than `reach` mm to x = 0.
bool is_midline_landmark(const std::string& name, const Eigen::Vector3d& position, double reach = 8);

}  // namespace facewright
