// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

namespace facewright {

/// Text as XML and HTML show it, also within quotes; control characters but tab and line feed, which XML does not know,
/// become spaces.
std::string markup_text(const std::string& text);

}  // namespace facewright
