// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <string_view>

#include "libmodel/io/sha256.h"

namespace facewright {

/// SHA-256 of the numbers of a plain matrix (not of a block), hexadecimal.
template <class Matrix>
std::string sha256_of(const Matrix& m) {
  return sha256(std::string_view(reinterpret_cast<const char*>(m.data()),
                                 sizeof(typename Matrix::Scalar) * static_cast<size_t>(m.size())));
}

}  // namespace facewright
