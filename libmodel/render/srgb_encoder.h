// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <array>
#include <cstdint>

namespace facewright {

/// srgb8_from_linear for floats, by table: the same byte for every float, about ten times as fast. A table of 4096
/// steps gives the byte at the start of the step; no step holds more than one place where the byte changes, and that
/// place is known exactly.
class SrgbEncoder {
 public:
  static const SrgbEncoder& get();

  std::uint8_t operator()(float linear) const {
    const float x = linear > 0 ? (linear < 1 ? linear : 1) : 0;  // NaN becomes 0
    const unsigned code = byte_[static_cast<unsigned>(x * 4096)];
    return static_cast<std::uint8_t>(code + (x >= next_[code]));
  }

 private:
  SrgbEncoder();
  std::array<std::uint8_t, 4097> byte_{};  ///< of i / 4096
  std::array<float, 256> next_{};          ///< the least float that gives more than this byte
};

}  // namespace facewright
