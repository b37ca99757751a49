// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

#include "libmodel/model/morphable_model.h"

namespace facewright {

/// How far one quantity of a coarse level is from being the leading part of the next finer level's.
struct NestingRow {
  int coarse = 0, fine = 0;  ///< vertices
  std::string quantity;
  double deviation = 0;  ///< largest absolute difference of a number; infinity if parts are missing
  double tolerance = 0;  ///< what is still nested: 0 but for bases made orthonormal level by level
  std::string unit;      ///< "mm", "", ...
  bool holds() const { return deviation <= tolerance; }
};

/// Compares two models of one level each, the first of which should be the leading rows of the second: mean, basis and
/// variances of shape, colour and expression, texture coordinates, landmark vertices and places, regions, contours,
/// symmetry, parents. Only what either has is listed. Bases that are not the same row by row are compared up to a
/// rotation of the coefficients: the largest difference that is left between the rows of basis * diag(sqrt(variances)),
/// which is what making a level's basis orthonormal leaves (rounding of float32: tolerance 1e-5 of the largest row, mm
/// or colour units per standard deviation).
std::vector<NestingRow> compare_levels(const MorphableModel& coarse, const MorphableModel& fine);

/// Whether all rows hold, and the largest deviation among those of tolerance 0.
bool all_hold(const std::vector<NestingRow>& rows);
double largest_deviation(const std::vector<NestingRow>& rows);

}  // namespace facewright
