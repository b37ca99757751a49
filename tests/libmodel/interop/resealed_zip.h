// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>

namespace facewright::testing {

inline std::uint32_t zip_checksum(const char* data, size_t size) {
  std::uint32_t crc = 0xffffffffu;
  for (size_t i = 0; i < size; ++i) {
    crc ^= static_cast<unsigned char>(data[i]);
    for (int k = 0; k < 8; ++k) crc = crc & 1 ? 0xedb88320u ^ (crc >> 1) : crc >> 1;
  }
  return crc ^ 0xffffffffu;
}

/// An archive whose stored members were changed, with checksums that are true again: what is then refused is refused
/// for its content.
inline std::string resealed(std::string bytes) {
  const auto number = [&](size_t at) {
    std::uint32_t x = 0;
    if (at + 4 <= bytes.size()) std::memcpy(&x, bytes.data() + at, 4);
    return x;
  };
  const auto seal = [&](size_t at, std::uint32_t x) { std::memcpy(bytes.data() + at, &x, 4); };
  const size_t directory = bytes.size() >= 22 ? number(bytes.size() - 6) : bytes.size();
  for (size_t at = directory; at + 46 <= bytes.size() && number(at) == 0x02014b50;) {
    const size_t local = number(at + 42), size = number(at + 20), name = number(at + 28) & 0xffff;
    const size_t start = local + 30 + name;
    if (start > bytes.size() || size > bytes.size() - start) break;
    const std::uint32_t crc = zip_checksum(bytes.data() + start, size);
    seal(at + 16, crc);
    seal(local + 14, crc);
    at += 46 + name;
  }
  return bytes;
}

}  // namespace facewright::testing
