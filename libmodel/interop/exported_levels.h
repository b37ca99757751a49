// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "libmodel/model/nesting.h"

namespace facewright {

/// Nesting of one kind of exported file over the levels, as read back from disk.
struct ExportNesting {
  std::string file;              ///< such as "levels/V/mean.ply" or "export/eos_V.bin"
  std::vector<NestingRow> rows;  ///< every level against the next finer one
};

/// What export_level_files left in a folder, as a model without modes: the mean of mean.ply and the companions beside
/// it. Throws IoError for malformed or inconsistent files, edge topology included.
MorphableModel read_level_folder(const std::filesystem::path& folder);

/// Vertex counts of a model's levels, coarsest first.
std::vector<int> level_counts(const MorphableModel& model);

// The proofs look at the levels in `counts` alone: files of other levels, which another build may have left in the same
// folder, are no part of the model.

/// Of the folders of levels (named by their vertex counts), from mean.ply with companions and from mean.obj.
std::vector<ExportNesting> nesting_of_level_folders(const std::filesystem::path& levels,
                                                    const std::vector<int>& counts);
/// Of eos_V.bin with its companions, statismo_V.h5, model_V.npz and model_V.glb in one folder, as far as they are
/// there.
std::vector<ExportNesting> nesting_of_exports(const std::filesystem::path& folder, const std::vector<int>& counts);
/// Of a build's output: levels/ and export/. Throws InvalidInput if neither holds a file of these levels, IoError for
/// what cannot be read.
std::vector<ExportNesting> exported_nesting(const std::filesystem::path& output, const std::vector<int>& counts);

/// The rows as JSON, for the record beside the files.
std::string nesting_json(const std::vector<ExportNesting>& proof);

}  // namespace facewright
