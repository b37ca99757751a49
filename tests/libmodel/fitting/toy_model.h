// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/camera.h"
#include "libmodel/core/landmarks.h"
#include "libmodel/model/morphable_model.h"

namespace facewright {

/// A face-like height field, 25 x 31 vertices on an ellipsoid patch with a nose, 140 x 180 x 90 mm, with smooth modes
/// of a few millimetres, uv, colours, and ibug-named landmarks: 18..68 on the inner face, the jaw 1..17 along a lower
/// arc.
MorphableModel toy_model(int modes = 8);

/// The landmarks of a face under a camera, by projection of its vertices.
ImageLandmarks project_landmarks(const MorphableModel& model, const Vertices& V, const AffineCamera& camera);

}  // namespace facewright
