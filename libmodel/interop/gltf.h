// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>

#include "libmodel/model/morphable_model.h"

namespace facewright {

struct GltfOptions {
  int modes = 20;             ///< leading shape modes, and as many of the expression model; >= 0
  int texture_size = 512;     ///< pixels, 16..8192; 0 = colours at the vertices even if there are texture coordinates
  bool morph_normals = true;  ///< normals of the morph targets: right shading while a face moves, twice the size
};

/// A model of one level as binary glTF 2.0: the mean in metres with normals, and named morph targets, each the step of
/// one standard deviation: "shape 1" .., "expression mean" (where it is not zero), "expression 1" .., and the
/// blendshapes by their own names. With colours and texture coordinates the mean colour is an embedded sRGB texture
/// (viewers multiply COLOR_0 with it, so there is no COLOR_0; the exact colours are in _MEAN_COLOR); with colours alone
/// it is COLOR_0, linear. The mesh's extras: targetNames, and facewright {units, per target kind and sigma_mm,
/// landmarks as vertices}. Throws InvalidInput for a model of several levels.
std::string glb_bytes(const MorphableModel& model, const GltfOptions& options = {});

/// Reads a file of glb_bytes back in millimetres: morph targets with a sigma become modes of the shape or expression
/// model, named others blendshapes (so do all targets of other programs' files, whose normals, materials and textures
/// are ignored). The first primitive of the first mesh counts. Throws IoError.
MorphableModel read_glb_model(const std::filesystem::path& path);

}  // namespace facewright
