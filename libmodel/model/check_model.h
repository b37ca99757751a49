// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "libmodel/model/morphable_model.h"

namespace facewright {

/// One property of a model and whether it holds.
struct ModelCheck {
  std::string property;
  bool holds = false;
  std::string detail;  ///< figures
};

/// What every model must satisfy: orthonormal bases of the finest level (max |B'B - I| < 1e-5, float32 storage),
/// variances in order, manifold triangles that use every vertex. O(N K^2).
std::vector<ModelCheck> check_model(const MorphableModel& model);

/// The same for a model file, plus the proof that each stored level is the leading part of the finest: means, bases,
/// texture coordinates, landmark vertices and variances are compared bit by bit. Throws IoError like load_model.
std::vector<ModelCheck> check_model_file(const std::filesystem::path& path);

}  // namespace facewright
