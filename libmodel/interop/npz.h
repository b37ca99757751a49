// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>

#include "libmodel/model/morphable_model.h"

namespace facewright {

/// A model of one level as a NumPy .npz (stored zip): shape_mean (N, 3), shape_basis (3N, K), shape_variances (K), the
/// same for colour (linear RGB) and expression, blendshapes (3N, B), all float32; faces (M, 3), mirror (N),
/// landmark_vertices (L) int32; uv (N, 2) float64; landmark_names (L), blendshape_names (B) unicode. instance = mean +
/// basis @ (sqrt(variances) * c).
std::string npz_bytes(const MorphableModel& model);

/// Reads such an archive, stored or compressed, as a model of one level. Throws IoError.
MorphableModel read_npz_model(const std::filesystem::path& path);

}  // namespace facewright
