// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <stdexcept>
#include <string>

namespace facewright {

/// The caller's data or options cannot be used; the message says what was expected, what came and what to do.
class InvalidInput : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file could not be read or written. The message starts with "path:line: " where a line is known.
class IoError : public std::runtime_error {
 public:
  IoError(const std::string& path, const std::string& what) : std::runtime_error(path + ": " + what), path_(path) {}
  IoError(const std::string& path, int line, const std::string& what)
      : std::runtime_error(path + ":" + std::to_string(line) + ": " + what), path_(path), line_(line) {}
  const std::string& path() const { return path_; }
  int line() const { return line_; }  ///< 1-based, 0 if unknown

 private:
  std::string path_;
  int line_ = 0;
};

/// A numerical method broke down (a factorisation failed); poor quality is never an error but a summary.
class SolverError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace facewright
