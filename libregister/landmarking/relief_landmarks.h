// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"
#include "libmodel/core/similarity.h"
#include "libregister/landmarking/relief.h"
#include "libregister/landmarking/view_landmarks.h"

namespace facewright {

/// The reference as the landmarks found so far bend it, in the scan's place.
struct BentReference {
  Mesh mesh;
  Landmarks marks;  ///< its landmarks, scan coordinates
};

/// Landmarks found by their surroundings' relief: reference and scan are seen from the same sides, and each landmark's
/// patch of the one is looked for in the other. One table per side, as in landmarks_in_view(); the deviations rise as
/// correlations fall. Needs no colours and no dlib. Some 50 ms a side.
std::vector<Landmarks> relief_landmarks(const Mesh& scan, const BentReference& reference,
                                        const Similarity& scan_from_head, const std::vector<ViewAngle>& angles,
                                        const FaceViewOptions& view, const PatchMatchOptions& options,
                                        const ReliefOptions& shape = {});

}  // namespace facewright
