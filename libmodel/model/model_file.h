// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "libmodel/model/morphable_model.h"

namespace facewright {

/// Writes a model as HDF5: the root is the finest level as a statismo 0.9 morphable model (the layout of the Basel Face
/// Model 2017, readable by statismo and scalismo-faces), /level0 .. /levelK hold one such model each, with orthonormal
/// bases of their own, and what those formats have no place for is under metadata/ext: among it, the maps between a
/// level's own coefficients and those all levels share. Numbers are float32 (uv float64), so loading rounds a freshly
/// built model once, and saving a loaded model reproduces the file byte for byte. Atomic. The layout:
/// docs/model-file.md.
void save_model(const std::filesystem::path& path, const MorphableModel& model);

/// The same bytes, in memory.
std::string serialise_model(const MorphableModel& model);

/// Reads the model at `group` of a file: "/" is the whole model with its levels, "/level0" one level of it, with the
/// coefficients that all levels share: rows of the finest level's basis, hence not orthonormal, as
/// MorphableModel::level gives them, bit by bit. Also reads statismo 0.8, 0.9 and 1 files of others (shape alone, or
/// shape + color + expression; units other than mm are converted where the file states them); landmarks given as
/// coordinates move to the nearest vertex of the mean. Throws IoError naming the dataset, what was expected, what came
/// and what to do; refused are NaN, variances out of order, columns that are not orthonormal, triangles beyond the
/// vertices, in files of ours also other units and triangles wound inwards, and a level whose mean is not the leading
/// part of the finest. HDF5 1.10 itself crashes on some damaged files: try_model_file first what comes from strangers.
MorphableModel load_model(const std::filesystem::path& path, const std::string& group = "/");

/// Walks an HDF5 file in a copy of the process (guarded_call) before it is read in this one, as all programs do: opens
/// every group and dataset, and reads what is small, text, or not stored plainly. Refused are also links to other files
/// and numbers stored there. Throws IoError. A few milliseconds: large plain arrays are not read.
void try_model_file(const std::filesystem::path& path);

/// Vertex counts of the levels /level0, /level1, ... of a file, coarsest first; empty if it has no such groups.
std::vector<int> stored_levels(const std::filesystem::path& path);

/// What a coarse level's group stores of a part ("shape", "color", "expression"), which is what other programs read: an
/// orthonormal basis of the level's own, and the map of coefficients. Nothing if coefficients are the shared ones: the
/// finest level, and files of version 1 and 2. Throws IoError.
std::optional<OrthonormalLevel> stored_statistics(const std::filesystem::path& path, const std::string& group,
                                                  const std::string& part);

/// The edge topology as stored with a level, for readers that do not want to work it out (0-based, -1 = no triangle);
/// empty if there is none. MorphableModel::edge_topology is the same.
std::vector<Edge> stored_edges(const std::filesystem::path& path, const std::string& group = "/");

}  // namespace facewright
