// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace facewright {

/// The median of x, the upper one of an even number; reorders x. 0 if x is empty.
inline double median_of(std::vector<double>& x) {
  if (x.empty()) return 0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

}  // namespace facewright
