// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstring>

namespace facewright {

// Four numbers at a time, by the vector types of GCC and Clang: one instruction each on every processor of today.
using Float4 = float __attribute__((vector_size(16)));
using Int4 = int __attribute__((vector_size(16)));

template <typename Vector, typename Number>
inline Vector load4(const Number* p) {
  Vector v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
template <typename Vector, typename Number>
inline void store4(Number* p, const Vector& v) {
  std::memcpy(p, &v, sizeof v);
}
inline Float4 broadcast4(float x) { return Float4{x, x, x, x}; }

}  // namespace facewright
