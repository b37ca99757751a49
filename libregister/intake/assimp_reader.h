// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: what assimp makes of a file, without its types.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace facewright {

struct ForeignMesh {
  std::vector<std::array<float, 3>> positions;  ///< in the axes of the scene
  std::vector<std::array<float, 3>> colours;    ///< as stored, or empty
  std::vector<std::array<float, 2>> uv;         ///< or empty
  std::vector<std::array<int, 3>> triangles;    ///< of positions
  int material = -1;                            ///< of ForeignScene::pictures
};

struct ForeignScene {
  std::vector<ForeignMesh> meshes;
  std::vector<std::string> pictures;  ///< per material the name of its picture; "*0" is one within the file
};

/// Reads a mesh file with assimp as the format of an extension (".stl"). assimp forgives much and checks little: it
/// works in a copy of the process, of bounded time and memory (guarded_call). Throws IoError.
ForeignScene read_with_assimp(const std::filesystem::path& file, const std::string& format);

}  // namespace facewright
