// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace facewright {

/// The images that names stand for, in order: a file; a folder, which means all pictures in it (by extension: png, jpg,
/// jpeg, bmp, tga, ppm, pgm), numbers in names counting as numbers; or a numbered sequence such as "frames/%04d.png",
/// which means all files of that form (%d takes any number of digits, %04d at least four). Throws InvalidInput for
/// names that stand for nothing and for two images of one stem, whose results would overwrite each other.
std::vector<std::filesystem::path> list_images(const std::vector<std::string>& names);

}  // namespace facewright
