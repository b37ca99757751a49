// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>

#include "libmodel/model/morphable_model.h"

namespace facewright {

/// A model of one level as an eos .bin file: class version 4 (with landmarks and expressions: the PCA model, or if
/// there is none the blendshapes), or 1 (shape, colour and texture coordinates only, what the Surrey face models use).
/// float32; v runs down in eos. Throws InvalidInput for a model of several levels or another version.
std::string eos_model_bytes(const MorphableModel& model, int version = 4);

/// Reads an eos .bin file of class version 1 to 4 as a model of one level, v up again. A basis whose columns are not
/// orthonormal (--basis shared) is kept and marked so. Texture coordinates of version 4's own triangles are taken to
/// the vertices where each vertex has one only; a seam is refused. Throws IoError naming the part, what was expected
/// and what came.
MorphableModel read_eos_model(const std::filesystem::path& path);

}  // namespace facewright
