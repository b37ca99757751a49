// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <functional>

namespace facewright {

/// Number of hardware threads, at least 1.
int hardware_threads();

/// Calls body(i) for i in [0, n) on up to `threads` threads (0 = all). Every i writes only its own results, so bytes do
/// not depend on the number of threads. The first exception (lowest i) is rethrown after all threads have stopped.
void parallel_for(int n, int threads, const std::function<void(int)>& body);

/// The same in contiguous blocks: body(first, last).
void parallel_blocks(int n, int threads, const std::function<void(int, int)>& body);

}  // namespace facewright
