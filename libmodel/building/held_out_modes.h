// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/building/fill_unseen.h"

namespace facewright {

// Private to this module.

struct HeldOutModes {
  int modes = 0;
  HeldOutError error;
};

/// How many modes fill best: of at most 3000 vertices and 200 samples a tenth of the values is hidden - contiguous
/// patches where there is a surface V (N x 3), scattered vertices where V is empty -, and models of 0, 1, 2, 3, 4, 6,
/// ... modes foretell them, until two in a row are worse than the best.
HeldOutModes choose_modes_by_hiding(const SampleMatrix& values, const SampleMatrix& weights, const Vertices& V,
                                    const FillUnseenOptions& options);

}  // namespace facewright
