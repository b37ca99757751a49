// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: which picture each triangle of an OBJ file uses.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace facewright {

struct ObjTextures {
  std::vector<std::string> pictures;  ///< as the material files name them
  std::vector<int> of_triangle;       ///< per triangle in the file's order, polygons fanned; -1: none
  std::vector<std::string> warnings;
};

/// Reads the material files that the OBJ names, from its own folder, and follows its usemtl lines.
ObjTextures read_obj_textures(const std::filesystem::path& obj);

}  // namespace facewright
