// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/text_encoding.h"

#include <cstdint>

namespace facewright {
namespace {

// Bytes of the character at `at`, 0 if it is none: no longer form than needed, no surrogates, at most 10ffff.
size_t character(const std::string& text, size_t at) {
  const auto byte = [&](size_t i) -> unsigned { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0; };
  const unsigned first = byte(at);
  if (first < 0x80) return 1;
  const size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  std::uint32_t code = first & (0xffu >> (length + 1));
  for (size_t i = 1; i < length; ++i) {
    if ((byte(at + i) & 0xc0) != 0x80) return 0;
    code = code << 6 | (byte(at + i) & 0x3f);
  }
  constexpr std::uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xd800 && code < 0xe000;
  return first < 0xc0 || first > 0xf7 || code < kLeast[length] || surrogate || code > 0x10ffff ? 0 : length;
}

}  // namespace

std::string as_utf8(std::string text) {
  for (size_t at = 0; at < text.size();) {
    const size_t length = character(text, at);
    if (length > 0) {
      at += length;
      continue;
    }
    std::string result;
    for (const char c : text) {
      const auto byte = static_cast<unsigned char>(c);
      if (byte >= 0x80) result += static_cast<char>(0xc0 | byte >> 6);
      result += byte < 0x80 ? c : static_cast<char>(0x80 | (byte & 0x3f));
    }
    return result;
  }
  return text;
}

}  // namespace facewright
