// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>

#include "libregister/reference/reference_face.h"

namespace facewright {

/// Writes a reference face as one text file, which build-model --reference takes (docs/reference.md). Throws IoError.
void save_reference_file(const std::filesystem::path& file, const ReferenceFace& face);

/// Reads what save_reference_file wrote. Throws IoError with the line for a file that is damaged, and with advice for
/// one that is no reference file (a mesh, say).
ReferenceFace load_reference_file(const std::filesystem::path& file);

}  // namespace facewright
