// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/jpeg_tables.h"

namespace facewright {
namespace {

constexpr size_t kCounts = 16, kMostCodes = 256;

// Behind its end a file goes on with zeros, to stb.
size_t byte(std::string_view bytes, size_t at) { return at < bytes.size() ? static_cast<unsigned char>(bytes[at]) : 0; }

// The tables of a segment, its length at `at`: each is a class, 16 counts, and as many values as these say.
bool tables_fit(std::string_view bytes, size_t at) {
  const size_t end = at + (byte(bytes, at) << 8 | byte(bytes, at + 1));
  for (at += 2; at < end && at < bytes.size();) {
    size_t codes = 0;
    for (size_t i = 1; i <= kCounts; ++i) codes += byte(bytes, at + i);
    if (codes > kMostCodes) return false;
    at += 1 + kCounts + codes;
  }
  return true;
}

}  // namespace

bool jpeg_tables_fit(std::string_view bytes) {
  constexpr size_t kRestart = 0xd0, kStart = 0xd8, kEnd = 0xd9, kTables = 0xc4;
  if (!bytes.starts_with("\xff")) return true;
  // As stb goes: whatever stands between two segments, compressed data among it, ends with ff and a byte that means
  // one.
  for (size_t at = bytes.find('\xff'); at < bytes.size(); at = bytes.find('\xff', at)) {
    while (at < bytes.size() && byte(bytes, at) == 0xff) ++at;
    const size_t marker = byte(bytes, at++);
    if (marker == kEnd) return true;
    if (marker == 0 || (marker >= kRestart && marker <= kStart)) continue;
    if (marker == kTables && !tables_fit(bytes, at)) return false;
    at += byte(bytes, at) << 8 | byte(bytes, at + 1);
  }
  return true;
}

}  // namespace facewright
