// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace facewright {

// Private to this module.

/// An open file, read and written at offsets from several threads. Everything throws IoError.
class SampleFile {
 public:
  enum class Mode { read_write, create };
  SampleFile() = default;
  SampleFile(const std::filesystem::path& path, Mode mode);
  SampleFile(SampleFile&& other) noexcept;
  SampleFile& operator=(SampleFile&& other) noexcept;
  ~SampleFile();

  void read(void* bytes, std::uint64_t count, std::uint64_t offset) const;
  void write(const void* bytes, std::uint64_t count, std::uint64_t offset);
  std::uint64_t size() const;
  void sync();        ///< returns when the bytes are on disk
  bool lock_alone();  ///< until the file is closed; false if another process holds it
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  int descriptor_ = -1;
};

/// Writes all or nothing: a temporary file beside, synced, renamed.
void replace_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace facewright
