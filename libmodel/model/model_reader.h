// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>

#include "libmodel/model/morphable_model.h"

namespace facewright {

// Private to this module.

/// load_model, which refuses what does not nest or is wound inwards (`proven`), or the same without these two proofs,
/// for checks that want to show by how much it fails. The whole of a file is always proven to nest.
enum class Loading { proven, unproven };
MorphableModel load_model(const std::filesystem::path& path, const std::string& group, Loading loading);

}  // namespace facewright
