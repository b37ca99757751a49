// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>

namespace facewright {

/// A folder of a test's own, gone with everything in it at the end of the scope.
class TemporaryDirectory {
 public:
  TemporaryDirectory();
  ~TemporaryDirectory();
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// Runs a program of this build (FACEWRIGHT_BIN_DIR) or any command line in a shell, without its output mixed in.
struct CommandResult {
  int exit_code = -1;
  std::string output;  ///< stdout and stderr
};
CommandResult run_command(const std::string& command_line);

}  // namespace facewright
