// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: what stb does not check of a JPEG file.
#pragma once

#include <string_view>

namespace facewright {

/// Whether a file may be given to stb (2.27, for one), which fills tables of 256 codes by the counts in a JPEG file and
/// beyond: no table counts more. True for what is no JPEG.
bool jpeg_tables_fit(std::string_view bytes);

}  // namespace facewright
