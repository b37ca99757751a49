// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "libmodel/model/morphable_model.h"
#include "libmodel/model/nesting.h"

namespace facewright {

/// One property of a model and whether it holds.
struct ModelCheck {
  std::string property;
  bool holds = false;
  std::string detail;  ///< figures
};

/// What every model must satisfy: orthonormal bases of the finest level (max |B'B - I| < 1e-5, float32 storage),
/// variances in order, oriented manifold triangles that use every vertex, an exact symmetry table. O(N K^2).
std::vector<ModelCheck> check_model(const MorphableModel& model);

/// One row of the nesting proof, with its figure.
ModelCheck nesting_check(const NestingRow& row);

/// The same for every level of a model file, plus the proof that each level is the leading part of the next finer one:
/// everything stored with the levels is compared, with the largest deviation of each quantity (compare_levels), the
/// stored edge topology with the triangles, and the orthonormal basis that a coarse level's group holds with the shared
/// rows, through the stored map. Throws IoError like load_model.
std::vector<ModelCheck> check_model_file(const std::filesystem::path& path);

}  // namespace facewright
