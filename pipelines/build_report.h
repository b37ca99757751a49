// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/registered_set.h"
#include "libmodel/model/morphable_model.h"
#include "pipelines/build_pipeline.h"
#include "pipelines/output_tree.h"

namespace facewright {

/// Writes OUT/report/index.html and its pictures: the registered scans, the mean, the leading modes from -3 to +3
/// standard deviations, random faces, and a row per scan with the ones left out first.
void write_build_report(const MorphableModel& model, const RegisteredSet& set, const BuildPipelineSummary& summary,
                        const BuildPipelineOptions& options, const OutputTree& tree);

}  // namespace facewright
