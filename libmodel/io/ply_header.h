// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: the header of a PLY file.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace facewright {

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
size_t size_of(PlyType type);

enum class PlyEncoding { ascii, little_endian, big_endian };

struct PlyProperty {
  std::string name;
  bool is_list = false;
  PlyType count_type = PlyType::uint8;
  PlyType type = PlyType::float32;
};

struct PlyElement {
  std::string name;
  std::int64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::ascii;
  std::vector<PlyElement> elements;
  size_t body_offset = 0;  ///< bytes before the body
  int body_line = 1;       ///< its first line
};

/// Throws IoError for anything malformed, and for element counts that the bytes left in the file cannot hold.
PlyHeader parse_ply_header(std::string_view bytes, const std::string& path);

}  // namespace facewright
