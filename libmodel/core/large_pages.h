// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstddef>

namespace facewright {

/// Asks the system for large pages behind fresh memory of several megabytes, whose first use costs more in page faults
/// of 4 KB than in work. A hint only: where it is not understood nothing happens.
void prefer_large_pages(void* data, std::size_t bytes);

}  // namespace facewright
