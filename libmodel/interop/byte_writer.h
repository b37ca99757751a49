// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <bit>
#include <cstdint>
#include <string>

namespace facewright {

// Private to this module.

/// Appends plain values as little-endian bytes.
class ByteWriter {
 public:
  template <class T>
  void value(T x) {
    static_assert(std::endian::native == std::endian::little, "files are little-endian; swap bytes here");
    bytes_.append(reinterpret_cast<const char*>(&x), sizeof(T));
  }
  template <class T>
  void array(const T* data, size_t count) {
    static_assert(std::endian::native == std::endian::little, "files are little-endian; swap bytes here");
    bytes_.append(reinterpret_cast<const char*>(data), count * sizeof(T));
  }
  void text(const std::string& s) { bytes_ += s; }
  void pad(size_t multiple, char fill) {
    while (bytes_.size() % multiple) bytes_ += fill;
  }
  size_t size() const { return bytes_.size(); }
  const std::string& bytes() const { return bytes_; }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

}  // namespace facewright
