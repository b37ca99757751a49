// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: what a file holds, whatever it is called.
#pragma once

#include <filesystem>
#include <string>

namespace facewright {

/// The mesh format by the file's first bytes: ".ply", ".obj", ".stl", ".off", ".glb", or empty: not told. Throws
/// IoError for what is certainly no mesh (pictures, archives, documents) or cannot be opened.
std::string mesh_format_by_content(const std::filesystem::path& file);

}  // namespace facewright
