// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "libmodel/core/errors.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size);

namespace facewright::fuzz {

/// The folder of this process for the files of one input after the other; in memory where the system has such a place.
class Folder {
 public:
  Folder() : path_(parent() / ("facewright_fuzz_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::filesystem::path put(const std::string& name, std::string_view bytes) const {
    const std::filesystem::path file = path_ / name;
    std::ofstream(file, std::ios::binary) << bytes;
    return file;
  }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  static std::filesystem::path parent() {
    const std::filesystem::path memory = "/dev/shm";
    return ::access(memory.c_str(), W_OK) == 0 ? memory : std::filesystem::temp_directory_path();
  }
  std::filesystem::path path_;
};

/// Whether refusals are told, as replay_main.cpp wants.
inline bool tells = false;

inline void tell(const std::exception& refusal) {
  if (tells) std::printf("  refused: %s\n", refusal.what());
}

/// Runs a reader: it may succeed, or refuse with one of our errors. Anything else leaves, and ends the program.
template <class Reader>
void read_or_refuse(Reader&& reader) {
  try {
    reader();
    if (tells) std::printf("  read\n");
  } catch (const InvalidInput& error) {
    tell(error);
  } catch (const IoError& error) {
    tell(error);
  } catch (const SolverError& error) {
    tell(error);
  }
}

/// What must hold of whatever was read.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fputs(what, stderr);
  std::abort();
}

/// An input: its first byte says which format the rest is, as letters 'a', 'b', ... in kept inputs.
struct Input {
  Input(const std::uint8_t* data, size_t size, size_t formats)
      : format(size == 0 ? 0 : static_cast<size_t>(data[0] + 256 - 'a') % 256 % formats),
        bytes(reinterpret_cast<const char*>(data) + (size > 0), size - (size > 0)) {}
  size_t format;
  std::string_view bytes;
};

/// The two files of an input that stand one behind the other, parted by a line "--8<--".
struct TwoFiles {
  explicit TwoFiles(std::string_view bytes) {
    constexpr std::string_view kCut = "\n--8<--\n";
    const size_t at = bytes.find(kCut);
    first = bytes.substr(0, at);
    if (at != bytes.npos) second = bytes.substr(at + kCut.size());
  }
  std::string_view first, second;
};

}  // namespace facewright::fuzz
