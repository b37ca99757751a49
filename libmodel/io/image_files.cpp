// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/image_files.h"

#define STBI_NO_STDIO
#define STBI_NO_HDR
#define STBI_NO_LINEAR
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image.h>
#include <stb/stb_image_write.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/jpeg_tables.h"

namespace facewright {
namespace {

// Large pictures must have a byte for so many pixels: what is as good as empty compresses no further.
constexpr std::int64_t max_pixels = std::int64_t{1} << 28, always_allowed = std::int64_t{1} << 22,
                       pixels_per_byte = 1100;

void append(void* context, void* data, int size) {
  static_cast<std::string*>(context)->append(static_cast<const char*>(data), static_cast<size_t>(size));
}

// Whether the numbers in a PNM file's header are of a length that stb adds up without running over.
bool pnm_numbers_fit(const std::string& bytes) {
  if (bytes.size() < 2 || bytes[0] != 'P' || (bytes[1] != '5' && bytes[1] != '6')) return true;
  constexpr size_t kMostDigits = 9;
  size_t at = 2, digits = 0;
  for (int numbers = 0; numbers < 3 && at < bytes.size(); ++at) {  // width, height, greatest value
    const char c = bytes[at];
    if (c >= '0' && c <= '9') {
      if (++digits > kMostDigits) return false;
      continue;
    }
    numbers += digits > 0;
    digits = 0;
    if (c == '#') at = std::min(bytes.find('\n', at), bytes.size());
  }
  return true;
}

// Leaves out the chunks of a PNG file that hold no data of the picture: stb copies their nothing to memory it has not
// taken yet.
void drop_empty_png_data(std::string& bytes) {
  constexpr size_t kSignature = 8, kHead = 8, kFrame = 12;  // of a chunk: its length and type; and its checksum
  if (!bytes.starts_with("\x89PNG\r\n\x1a\n")) return;
  size_t kept = kSignature;
  for (size_t at = kSignature; at < bytes.size();) {
    size_t length = bytes.size() - at;
    if (length >= kHead) {
      size_t held = 0;
      for (size_t i = 0; i < 4; ++i) held = held << 8 | static_cast<unsigned char>(bytes[at + i]);
      if (held == 0 && bytes.compare(at + 4, 4, "IDAT") == 0) {
        at += std::min(length, kFrame);
        continue;
      }
      length = std::min(length, kFrame + held);
    }
    if (kept != at) bytes.replace(kept, length, bytes, at, length);
    kept += length;
    at += length;
  }
  bytes.resize(kept);
}

void check_writable(const Image& image) {
  const size_t expected = static_cast<size_t>(image.width) * image.height * image.channels;
  const bool channels_ok = image.channels == 1 || image.channels == 3 || image.channels == 4;
  if (image.width <= 0 || image.height <= 0 || !channels_ok || image.data.size() != expected)
    throw InvalidInput("image to write: expected a non-empty image of 1, 3 or 4 channels, got " +
                       std::to_string(image.width) + " x " + std::to_string(image.height) + " x " +
                       std::to_string(image.channels) + " with " + std::to_string(image.data.size()) + " bytes");
}

}  // namespace

Image read_image(const std::filesystem::path& path) {
  std::string bytes = read_file(path);
  drop_empty_png_data(bytes);
  if (bytes.size() > static_cast<size_t>(std::numeric_limits<int>::max()))
    throw IoError(path.string(), "image file above 2 GB");
  const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
  const int size = static_cast<int>(bytes.size());
  if (!jpeg_tables_fit(bytes)) throw IoError(path.string(), "damaged image: its Huffman tables are too long");
  if (!pnm_numbers_fit(bytes)) throw IoError(path.string(), "damaged image: it says a size of more than nine digits");
  int w = 0, h = 0, channels = 0;
  if (!stbi_info_from_memory(data, size, &w, &h, &channels))
    throw IoError(path.string(), "not a readable image (expected PNG, JPEG, BMP, TGA, PSD, GIF or PNM)");
  const std::int64_t area = std::int64_t{w} * h;
  if (area > max_pixels || (area > always_allowed && area / pixels_per_byte > size))
    throw IoError(path.string(), "image of " + std::to_string(w) + " x " + std::to_string(h) + " pixels is too large");
  const int wanted = channels == 1 ? 1 : channels == 3 ? 3 : 4;
  const std::unique_ptr<stbi_uc, decltype(&stbi_image_free)> pixels(
      stbi_load_from_memory(data, size, &w, &h, &channels, wanted), &stbi_image_free);
  if (!pixels) throw IoError(path.string(), std::string("damaged image: ") + stbi_failure_reason());
  if (w <= 0 || h <= 0) throw IoError(path.string(), "holds no pixels");
  Image image(w, h, wanted);
  image.data.assign(pixels.get(), pixels.get() + image.data.size());
  return image;
}

std::string png_bytes(const Image& image) {
  check_writable(image);
  std::string bytes;
  if (!stbi_write_png_to_func(append, &bytes, image.width, image.height, image.channels, image.data.data(), 0))
    throw InvalidInput("image to write: cannot be encoded as PNG");
  return bytes;
}

void write_png(const std::filesystem::path& path, const Image& image) { write_file(path, png_bytes(image)); }

std::string jpeg_bytes(const Image& image, int quality) {
  check_writable(image);
  if (quality < 1 || quality > 100) throw InvalidInput("JPEG quality: expected 1..100, got " + std::to_string(quality));
  std::string bytes;
  if (!stbi_write_jpg_to_func(append, &bytes, image.width, image.height, image.channels, image.data.data(), quality))
    throw InvalidInput("image to write: cannot be encoded as JPEG");
  return bytes;
}

void write_jpeg(const std::filesystem::path& path, const Image& image, int quality) {
  write_file(path, jpeg_bytes(image, quality));
}

}  // namespace facewright
