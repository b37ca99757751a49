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

/// A vertex and where it should be, mm on `shape`.
struct SurfacePull {
  int vertex = -1;
  Eigen::Vector3d wanted = Eigen::Vector3d::Zero();
};

struct PullOptions {
  double near_enough = 1;  ///< mm: a vertex this near stays, a farther one is drawn so near; our choice
  double bump = 4;         ///< mm, standard deviation of the surface that comes along, on `shape` as it was; our choice
  int most_rounds = 200;   ///< over all pulls
};

struct PullSummary {
  int rounds = 0;
  double farthest = 0;  ///< mm, of the pulls in the end; more than near_enough where pulls contradict each other
};

/// Draws `shape` towards places it passes too far from, in bumps of a few millimetres. Where bumps overlap they share
/// the step instead of adding up, and round after round takes what is left missing, until all pulls are near enough (to
/// 1 micrometre). The midline stays in its plane. O(rounds N pulls).
PullSummary draw_surface(HalfFace& half, const std::vector<SurfacePull>& pulls, const PullOptions& options = {});

}  // namespace facewright
