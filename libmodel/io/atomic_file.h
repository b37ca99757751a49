// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace facewright {

/// The whole file. Throws IoError.
std::string read_file(const std::filesystem::path& path);

/// Writes all or nothing: into a temporary file in the same folder, fsync, rename. Creates missing parent folders.
/// A reader never sees half a file, and an interrupted run leaves the old one. Throws IoError.
void write_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace facewright
