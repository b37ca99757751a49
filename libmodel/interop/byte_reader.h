// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <bit>
#include <cstring>
#include <string>

#include "libmodel/core/errors.h"

namespace facewright {

/// Takes little-endian values out of a file's bytes. Private to this module. Throws IoError at the end of the file.
class ByteReader {
 public:
  ByteReader(const std::string& bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {}

  template <class T>
  T value() {
    T x{};
    array(&x, 1);
    return x;
  }
  template <class T>
  void array(T* data, size_t count) {
    static_assert(std::endian::native == std::endian::little, "files are little-endian; swap bytes here");
    expect(count, sizeof(T));
    if (count > 0) std::memcpy(static_cast<void*>(data), bytes_.data() + at_, count * sizeof(T));
    at_ += count * sizeof(T);
  }
  std::string text(size_t count) {
    expect(count, 1);
    at_ += count;
    return bytes_.substr(at_ - count, count);
  }
  /// Throws unless so many items are left; call it before memory is taken for them.
  void expect(size_t count, size_t size) const {
    if (count > (bytes_.size() - at_) / size) fail("ends too early");
  }
  [[noreturn]] void fail(const std::string& what) const { throw IoError(name_, what); }
  size_t position() const { return at_; }
  void seek(size_t at) {
    if (at > bytes_.size()) fail("ends too early");
    at_ = at;
  }
  bool at_end() const { return at_ == bytes_.size(); }

 private:
  const std::string& bytes_;
  std::string name_;
  size_t at_ = 0;
};

}  // namespace facewright
