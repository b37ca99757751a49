// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: numbers and text appended to a string, without locale.
#pragma once

#include <charconv>
#include <string>
#include <string_view>

namespace facewright {

/// Shortest text that reads back as the same number.
template <typename Number>
void append_number(std::string& out, Number value) {
  char buffer[40];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  out.append(buffer, result.ptr);
}

/// "a b c", numbers separated by blanks.
template <typename Row>
void append_row(std::string& out, const Row& row) {
  for (int i = 0; i < row.size(); ++i) {
    if (i > 0) out += ' ';
    append_number(out, row[i]);
  }
}

}  // namespace facewright
