// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "libregister/reference/half_face.h"

namespace facewright {

/// A landmark to be made a vertex of the half face.
struct LandmarkWish {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< on or near `shape`, mm
  int near = -1;  ///< a vertex of the half that the landmark belongs to, or -1: anywhere
  bool on_midline = false;
  bool on_slit = false;  ///< on the margin of the lip that holds `near`
};

struct MarkOptions {
  double patch = 15;      ///< mm: how far from `near` the landmark is looked for
  double snap = 0.15;     ///< mm: a vertex this near is taken as it is
  double slit_reach = 1;  ///< mm: landmarks of the slit farther from their lip's margin go onto the surface
};

/// Makes the point of the half nearest to the wish a vertex of it, splitting what is there; its index. On midline and
/// slit the vertex lies on that line.
int mark_on_half(HalfFace& half, const LandmarkWish& wish, const MarkOptions& options = {});

}  // namespace facewright
