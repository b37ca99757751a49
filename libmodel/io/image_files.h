// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>

#include "libmodel/core/image.h"

namespace facewright {

/// Reads PNG, JPEG, BMP, TGA, PSD, GIF (first frame) or PNM, by content. Grey stays 1 channel, grey+alpha becomes
/// RGBA, 16-bit becomes 8-bit. Images above 2^28 pixels, and those above 2^22 with more than 1100 for each byte of the
/// file, are refused before anything is allocated. Throws IoError.
Image read_image(const std::filesystem::path& path);

/// An image as the bytes of a PNG file. Throws InvalidInput for an empty or inconsistent image.
std::string png_bytes(const Image& image);
/// The same as JPEG: quality 1..100; alpha is dropped (JPEG has none).
std::string jpeg_bytes(const Image& image, int quality = 92);
/// Writes atomically (write_file). Throws IoError, or InvalidInput for an empty or inconsistent image.
void write_png(const std::filesystem::path& path, const Image& image);
void write_jpeg(const std::filesystem::path& path, const Image& image, int quality = 92);

}  // namespace facewright
