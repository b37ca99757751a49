// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <array>
#include <cstdint>

#include "libmodel/render/simd4.h"

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

  /// Red, green and blue, the first three.
  void write(const Float4& linear, std::uint8_t* out) const {
    const Float4 zero = broadcast4(0), one = broadcast4(1), positive = linear > zero ? linear : zero;
    const Float4 x = positive < one ? positive : one;
    const Int4 step = __builtin_convertvector(x * broadcast4(4096), Int4);
    for (int k = 0; k < 3; ++k) {
      const unsigned code = byte_[static_cast<unsigned>(step[k])];
      out[k] = static_cast<std::uint8_t>(code + (x[k] >= next_[code]));
    }
  }

 private:
  SrgbEncoder();
  std::array<std::uint8_t, 4097> byte_{};  ///< of i / 4096
  std::array<float, 256> next_{};          ///< the least float that gives more than this byte
};

}  // namespace facewright
