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
  Mesh mesh;                                    ///< in the file's units and axes
  std::filesystem::path texture;                ///< image of most triangles, or empty
  std::vector<std::filesystem::path> textures;  ///< all images, if there are several
  std::vector<int> texture_of_triangle;         ///< (M) which of `textures`, -1: none; empty unless there are several
  int non_finite_triangles = 0;                 ///< left out: a corner was not a finite number
  int welded_vertices = 0;                      ///< vertices of the file that repeat another's position
  std::vector<std::string> warnings;            ///< what could not be used, in words
};

/// Reads what scanners write: PLY and OBJ (with its MTL) by our own readers, the rest, and OBJ that ours refuses,
/// through assimp. The content decides, whatever the file is called. Vertices of equal position are welded; wedge
/// coordinates stay in uv_faces. 8-bit vertex colours are taken as sRGB. Triangles whose corners are not finite numbers
/// are left out. Throws IoError for files that cannot be read, hold no triangles (point clouds), or are larger than 4
/// GiB.
ImportedMesh import_mesh(const std::filesystem::path& file);

/// File name extensions import_mesh accepts, lower case with the dot.
const std::vector<std::string>& mesh_extensions();

}  // namespace facewright
