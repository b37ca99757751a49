// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "libmodel/interop/byte_writer.h"

namespace facewright {

// Private to this module: as much of zip as .npz files are made of.

/// An uncompressed zip archive without time stamps: equal content is equal bytes.
class ZipWriter {
 public:
  void add(const std::string& name, const std::string& content);
  std::string finish();

 private:
  ByteWriter out_, directory_;
  std::uint16_t count_ = 0;
};

/// The members of an archive, stored or deflated, by name. What the directory says of sizes is checked against the
/// file before memory is taken (deflate makes nothing more than 1032 times smaller), the checksums afterwards. Throws
/// IoError for names that are paths, encrypted members, other compressions, and everything cut short or changed.
std::map<std::string, std::string> read_zip(const std::filesystem::path& path);

}  // namespace facewright
