// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libmodel/core/camera.h"
#include "libmodel/core/mesh.h"
#include "libregister/landmarking/face_view.h"

namespace facewright {

/// How far a surface rises above its surroundings, seen from one side: depth without what is smooth over centimetres
/// and without what is finer than some millimetres. Ridges are positive, furrows negative; shading does not matter.
struct Relief {
  int width = 0, height = 0;
  std::vector<float> rise;  ///< mm, row by row
  std::vector<bool> seen;   ///< false: nothing there, or too little around it

  size_t index(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
  bool has(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height && seen[index(x, y)]; }
};

struct ReliefOptions {
  double fine = 2;       ///< mm, deviation of the narrow mean ...
  double broad = 7;      ///< mm, ... and of the wide one whose difference is the rise
  double highest = 2.5;  ///< mm: rises are cut here, so that edges of the picture do not count for all
};

/// mm_per_pixel and depths are of the head's size.
Relief relief(const Raster& raster, double mm_per_pixel, double mm_per_depth, const ReliefOptions& options = {});

struct PatchMatchOptions {
  double patch = 9;         ///< mm, deviation of the weights around the point
  double reach = 12;        ///< mm: farther off it is not looked for
  double penalty = 0.25;    ///< of the correlation, at `reach`
  double least_rise = 0.2;  ///< mm: a patch with less deviation has nothing to be known by
};

struct PatchMatch {
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();  ///< pixels from the point in the pattern to its like in the scan
  double correlation = 0;                            ///< normalised, -1..1
};

/// Where the surroundings of a point of the pattern (pixels) are found again in the scan: highest normalised
/// cross-correlation [lewis1995], less for farther places. Nothing where the pattern is plain or the scan is not seen.
std::optional<PatchMatch> match_relief(const Relief& pattern, const Relief& scan, const Eigen::Vector2d& point,
                                       double mm_per_pixel, const PatchMatchOptions& options = {});

}  // namespace facewright
