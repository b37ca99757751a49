// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <string_view>

namespace facewright {

// Private to this module.

/// RFC 4648, with padding, in one line.
std::string base64(std::string_view bytes);

}  // namespace facewright
