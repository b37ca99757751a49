// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: a line-aware scanner over text in memory.
#pragma once

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>

#include "libmodel/core/errors.h"

namespace facewright {

/// Walks over text line by line, token by token; errors carry path and line.
class TextScanner {
 public:
  TextScanner(std::string_view text, std::string path)
      : p_(text.data()), end_(p_ + text.size()), path_(std::move(path)) {}

  bool at_end() const { return p_ == end_; }
  int line() const { return line_; }
  size_t remaining() const { return static_cast<size_t>(end_ - p_); }

  /// Skips blanks within the line; true if a token follows.
  bool more_on_line() {
    while (p_ != end_ && (*p_ == ' ' || *p_ == '\t' || *p_ == '\r')) ++p_;
    return p_ != end_ && *p_ != '\n';
  }
  /// Moves to the start of the next line.
  void next_line() {
    while (p_ != end_ && *p_ != '\n') ++p_;
    if (p_ != end_) ++p_, ++line_;
  }
  /// Skips blank space across lines.
  void skip_space() {
    while (!more_on_line() && p_ != end_) ++p_, ++line_;
  }
  /// Next token of the line (maybe empty).
  std::string_view token() {
    if (!more_on_line()) return {};
    const char* first = p_;
    while (p_ != end_ && !is_space(*p_)) ++p_;
    return {first, static_cast<size_t>(p_ - first)};
  }
  /// The rest of the line, trimmed.
  std::string_view rest_of_line() {
    if (!more_on_line()) return {};
    const char* first = p_;
    while (p_ != end_ && *p_ != '\n') ++p_;
    const char* last = p_;
    while (last != first && is_space(last[-1])) --last;
    return {first, static_cast<size_t>(last - first)};
  }
  /// A finite number at the cursor, on this line.
  double number() {
    if (!more_on_line()) fail("expected a number, got the end of the line");
    if (*p_ == '+') ++p_;
    double value = 0;
    const auto [next, error] = std::from_chars(p_, end_, value);
    if (error == std::errc::result_out_of_range) value = tiny_or_fail(next);
    if ((error != std::errc() && error != std::errc::result_out_of_range) || !std::isfinite(value) ||
        (next != end_ && !is_space(*next)))
      fail("expected a finite number, got '" + std::string(token()) + "'");
    p_ = next;
    return value;
  }
  /// A whole number directly at the cursor; the cursor stops behind its last digit.
  long long integer() {
    long long value = 0;
    const auto [next, error] = std::from_chars(p_, end_, value);
    if (error != std::errc()) fail("expected a whole number, got '" + std::string(token()) + "'");
    p_ = next;
    return value;
  }
  /// Consumes c at the cursor if it is there.
  bool accept(char c) {
    if (p_ == end_ || *p_ != c) return false;
    ++p_;
    return true;
  }
  bool at_token_end() const { return p_ == end_ || is_space(*p_); }

  [[noreturn]] void fail(const std::string& what) const { throw IoError(path_, line_, what); }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
  double tiny_or_fail(const char* next) const {
    const std::string_view text(p_, static_cast<size_t>(next - p_));
    if (text.find("e-") == text.npos && text.find("E-") == text.npos) fail("number out of range: " + std::string(text));
    return 0;  // underflow
  }

  const char* p_;
  const char* end_;
  std::string path_;
  int line_ = 1;
};

}  // namespace facewright
