// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace facewright {

// Private to this module.

/// A file of the page as built into the program; nothing if the build had none.
std::optional<std::string_view> viewer_asset(const std::string& name);

}  // namespace facewright
