// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "libmodel/model/morphable_model.h"

namespace facewright {

/// A model of one level as an .npz with the names and habits of FLAME: v_template (N, 3), shapedirs (N, 3, K), each a
/// step of one standard deviation, identity before expression, float32 in metres; f (M, 3) int32, 0-based. A face is
/// v_template + shapedirs @ c. Beyond FLAME: dir_names (K) ("shape 1", "expression mean" where it is not zero,
/// "expression 1", "blendshape NAME"), identity_count, texcoords (N, 2) with v up, landmark_vertices, landmark_names.
/// There are no joints, poses, or colours in it. Throws InvalidInput for a model of several levels.
std::string flame_npz_bytes(const MorphableModel& model);

}  // namespace facewright
