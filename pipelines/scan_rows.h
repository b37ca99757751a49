// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "pipelines/build_pipeline.h"
#include "pipelines/model_stage.h"
#include "pipelines/output_tree.h"

namespace facewright {

struct ScanTable {
  std::string html;
  double median_surface_mm = 0;  ///< of the registered scans' mean distances to their surface; 0 without scans
};

/// The report's table of scans as HTML: those left out first, then those that became part of the model, in order of id.
/// Pictures are those that lie in OUT; those of the first `most_pictures` registered scans are in the page, of all that
/// are left out too, and the others are linked. Rows are made on up to `threads` threads (0 = all); the bytes are the
/// same for any number. Each scan's report is read once. Throws IoError.
ScanTable scan_table(const MorphableModel& model, const ModelStageResult& stage, const BuildPipelineSummary& summary,
                     const OutputTree& tree, int threads = 0, int most_pictures = 200);

}  // namespace facewright
