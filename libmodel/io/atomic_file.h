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

/// The same, but a file that holds these bytes already is not touched. Returns whether it was written.
bool write_file_if_changed(const std::filesystem::path& path, std::string_view bytes);

/// Removes, in a folder and those below it, the temporary files of write_file that a dead process has left. Those of
/// processes that run on this machine stay. Returns how many went.
int remove_abandoned_temporaries(const std::filesystem::path& folder);

}  // namespace facewright
