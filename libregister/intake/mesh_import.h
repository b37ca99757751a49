// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "libmodel/core/image.h"
#include "libmodel/core/mesh.h"

namespace facewright {

/// A mesh file as it came, polygons cut into triangles, materials merged.
struct ImportedMesh {
  Mesh mesh;                          ///< in the file's units and axes
  std::filesystem::path texture;      ///< image of the material with most triangles, or empty
  std::vector<std::string> warnings;  ///< what could not be used, in words
};

/// Reads what scanners write (OBJ with MTL, STL, OFF, glTF, ...) through assimp, PLY through read_mesh. Vertices that
/// differ only in texture coordinates are welded; wedge coordinates stay in uv_faces. 8-bit vertex colours are taken as
/// sRGB. Throws IoError for files that cannot be read, hold no triangles (point clouds), or are larger than 4 GiB.
ImportedMesh import_mesh(const std::filesystem::path& file);

/// File name extensions import_mesh accepts, lower case with the dot.
const std::vector<std::string>& mesh_extensions();

}  // namespace facewright
