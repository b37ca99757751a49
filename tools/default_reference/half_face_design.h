// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "libmodel/core/landmarks.h"
#include "tools/default_reference/face_surface.h"

namespace facewright::face_design {

/// What is fixed of the subject's left half of the face: points, and polylines of them that become edges.
struct HalfFaceDesign {
  std::vector<Vector3d> points;
  std::vector<bool> midline, pinned;  ///< x = 0; may not move (landmarks and curve points)
  std::vector<std::array<int, 2>> segments;
  std::vector<int> outline;                          ///< closed polygon of points around the half face
  std::vector<Vector3d> curve_samples;               ///< dense samples of the segments, to keep free points away
  std::map<std::string, int> landmarks;              ///< of the left half and the midline
  std::map<std::string, std::vector<int>> polygons;  ///< closed: "left_eye", "lips"
  std::vector<int> brow, slit;
};

HalfFaceDesign design_half_face(const Landmarks& landmarks);

/// Wanted edge length at p, mm; only ratios matter.
double wanted_length(const Vector3d& p, const Landmarks& landmarks);

}  // namespace facewright::face_design
