// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "libmodel/building/metrics.h"
#include "libmodel/core/registered_set.h"
#include "libmodel/model/morphable_model.h"

namespace facewright {

/// Meshes in correspondence as they lie in a folder, ready to be measured.
struct EvaluationSet {
  std::vector<std::string> ids;  ///< (S) file stems, sorted
  MetricsInput shapes;           ///< weights are areas; the rim counts less in alignments
  MetricsInput colours;          ///< linear RGB, unseen entries filled; no samples if some mesh has no colours
  bool has_model = false;        ///< a model.h5 gave reference, levels and rim
};

struct EvaluationSetOptions {
  std::filesystem::path folder;  ///< of build-model, or of meshes
  bool registered = false;       ///< the folder holds the meshes themselves, whatever else there is
  std::filesystem::path
      truth;                ///< folder of meshes of the same ids and vertices to hold reconstructions against, or empty
  int level = -1;           ///< vertex count of the level to cut down to, or its index; -1 = finest
  double rim_weight = 0.2;  ///< as build-model's
  bool colours = true;      ///< read them too
  int threads = 0;          ///< 0 = all
};

/// Reads FOLDER/registered/*.ply with FOLDER/model.h5 and FOLDER/scans/*.origins, or all .ply and .obj of a folder of
/// meshes. Landmarks come from landmark_vertices.json beside the meshes, else from the model. Throws InvalidInput or
/// IoError that names the file: no meshes, another number of vertices or other triangles than the first.
EvaluationSet read_evaluation_set(const EvaluationSetOptions& options);

/// The same of scans that are at hand, cut down to a level (index) of the model made of them; of `options` the rim's
/// weight, colours and threads count.
EvaluationSet evaluation_set(const RegisteredSet& scans, const MorphableModel& model, int level,
                             const EvaluationSetOptions& options = {});

}  // namespace facewright
