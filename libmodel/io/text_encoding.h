// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

namespace facewright {

/// Text as UTF-8, which JSON and HDF5 want: as it is if it is that already, else each byte is taken for a character of
/// Latin-1, as older programs write names.
std::string as_utf8(std::string text);

}  // namespace facewright
