// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "pipelines/build_pipeline.h"
#include "pipelines/model_stage.h"
#include "pipelines/output_tree.h"

namespace facewright {

/// The report's table of scans as HTML: those left out first, then those that became part of the model, in order of id.
/// Pictures are those that lie in OUT; those of the first `most_pictures` registered scans are in the page, of all that
/// are left out too, and the others are linked.
std::string scan_table(const MorphableModel& model, const ModelStageResult& stage, const BuildPipelineSummary& summary,
                       const OutputTree& tree, int most_pictures = 200);

/// Median of the registered scans' mean distance to their surface, mm; 0 without scans.
double median_surface_distance(const BuildPipelineSummary& summary, const OutputTree& tree);

}  // namespace facewright
