// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <algorithm>
#include <string_view>

namespace facewright {

/// No file of ours or others' nests its JSON more deeply; what recurses over its values is safe up to here.
inline constexpr int kMostJsonDepth = 64;

/// How deeply lists and objects of a JSON text lie in one another. O(length), no memory: ask before it is parsed.
inline int json_depth(std::string_view text) {
  int depth = 0, deepest = 0;
  bool quoted = false;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted && c == '\\') ++i;
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    if (c == '[' || c == '{') deepest = std::max(deepest, ++depth);
    if (c == ']' || c == '}') --depth;
  }
  return deepest;
}

}  // namespace facewright
