// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/model/morphable_model.h"
#include "pipelines/build_pipeline.h"
#include "pipelines/model_stage.h"
#include "pipelines/output_tree.h"

namespace facewright {

/// Writes OUT/report/index.html, one file that needs nothing else: the counts, the model to turn and change (viewer.h),
/// mean, modes, deviation, levels and texture map, compactness, generalisation and specificity at the coarsest level,
/// a row per scan with its pictures, the ones left out first, and the model card. The figures behind the plots go to
/// OUT/report/evaluation. Throws IoError.
void write_build_report(const MorphableModel& model, const ModelStageResult& stage, const BuildPipelineSummary& summary,
                        const BuildPipelineOptions& options, const OutputTree& tree);

}  // namespace facewright
