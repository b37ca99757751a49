// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/multires_template.h"

namespace facewright {

/// A vertex on one lip of the mouth slit and the point (1 - t) a + t b facing it on the other.
struct Stitch {
  int vertex = -1, a = -1, b = -1;
  double t = 0;
};

/// Stitches of a level's mouth slit, one per vertex of either lip, the corners left out: the boundary loop in the
/// reference's region "mouth_slit", cut at its leftmost and rightmost vertex, each vertex paired with the point of the
/// other lip at the same x of the reference (head frame). Empty for references without such a loop.
std::vector<Stitch> seam_stitches(const MultiresTemplate& reference, int level);

}  // namespace facewright
