// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "libmodel/model/morphable_model.h"

namespace facewright {

enum class ExportFormat { obj, ply, eos, npz, statismo, glb, flame };

/// What happens to the basis of a level coarser than the finest, whose rows are not orthonormal.
enum class ExportBasis {
  orthonormal,  ///< made orthonormal, as the formats promise: the same faces with the same likelihood, other
                ///< coefficients
  shared        ///< left as it is: coefficients mean the same face at every level, but columns are not orthonormal
};

struct ExportOptions {
  ExportBasis basis = ExportBasis::orthonormal;  ///< eos, npz, statismo
  int eos_version = 4;                           ///< 1 or 4
  int morph_targets = 20;                        ///< glb: leading modes of shape and of expression
  int texture_size = 512;                        ///< glb, obj: pixels of the mean's texture; 0 = colours at vertices
};

/// Names of the formats: "obj", "ply" (the mean), "eos", "npz", "statismo", "flame" (the model), "glb" (mean and morph
/// targets).
/// Throws InvalidInput for another name.
ExportFormat export_format(const std::string& name);
const std::vector<std::string>& export_format_names();

/// Writes one level of a model for other programs, atomically.
void export_model(const std::filesystem::path& path, const MorphableModel& model, int level, ExportFormat format,
                  const ExportOptions& options = {});

/// Writes every level V of a model into `folder` in all model formats: eos_V.bin with its companions
/// (eos_V_landmarks.txt, eos_V_contours.json, eos_V_edge_topology.json, eos_V_symmetry.txt), statismo_V.h5,
/// model_V.npz, model_V.glb. Then reads them back and writes nesting.json, the proof that the levels nest in every
/// format; throws SolverError if one does not.
void export_all(const std::filesystem::path& folder, const MorphableModel& model, const ExportOptions& options = {});

/// Landmark names to vertices as eos reads them (TOML). The jaw's 1..8 and 10..17 are listed as contour landmarks, as
/// in the mapping that comes with eos: in a turned face they lie elsewhere along the contour.
std::string eos_landmark_mapping(const MorphableModel& model);

/// The same model with every basis orthonormal.
MorphableModel orthonormalised(const MorphableModel& model);

}  // namespace facewright
