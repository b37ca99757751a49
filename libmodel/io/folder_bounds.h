// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>

namespace facewright {

/// Whether a file lies in a folder or below it, once ".." and links are followed; a file that is not there counts by
/// its name. Names that the system refuses to look at (too long, links in circles) lie nowhere. For what a file names:
/// pictures, materials, scans.
bool lies_inside(const std::filesystem::path& file, const std::filesystem::path& folder);

/// Whether it is a file that can be looked at; never throws.
bool is_file(const std::filesystem::path& path);

}  // namespace facewright
