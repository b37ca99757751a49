// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>

#include "libmodel/model/morphable_model.h"

namespace facewright {

/// The mean of a one-level model as binary glTF 2.0 in metres, with vertex colours, texture coordinates, and the first
/// `targets` shape modes as morph targets of one standard deviation ("shape 1", ...).
std::string glb_bytes(const MorphableModel& model, int targets);

/// Reads back a file of glb_bytes: metres, morph targets as modes of variance 1, no landmarks. Throws IoError.
MorphableModel read_glb_model(const std::filesystem::path& path);

}  // namespace facewright
