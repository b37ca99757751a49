// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/srgb_encoder.h"

#include <cmath>
#include <limits>

#include "libmodel/core/image.h"

namespace facewright {

SrgbEncoder::SrgbEncoder() {
  for (size_t i = 0; i < byte_.size(); ++i) byte_[i] = srgb8_from_linear(static_cast<double>(i) / 4096);
  next_.back() = std::numeric_limits<float>::infinity();
  for (int code = 0; code < 255; ++code) {
    auto x = static_cast<float>(linear_from_srgb((code + 0.5) / 255));  // within a few steps of it
    while (srgb8_from_linear(double{x}) > code) x = std::nextafter(x, 0.0F);
    while (srgb8_from_linear(double{x}) <= code) x = std::nextafter(x, 2.0F);
    next_[static_cast<size_t>(code)] = x;
  }
}

const SrgbEncoder& SrgbEncoder::get() {
  static const SrgbEncoder encoder;
  return encoder;
}

}  // namespace facewright
