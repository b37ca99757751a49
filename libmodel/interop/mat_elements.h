// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>

namespace facewright {

// Private to this module.

/// Walks the variables of a MATLAB file of level 5 (versions 5 to 7) or 4, little-endian: every variable ends within
/// the file, the last one with it, compressed ones unpack whole with the right checksum, and arrays of numbers, also
/// within structures and cells, hold as many as their dimensions say. matio would take the memory that damaged sizes
/// ask for, and hand out whatever lies there for what is missing. Throws IoError.
void check_mat_elements(const std::filesystem::path& path);

}  // namespace facewright
