// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

#include "libmodel/core/multires_template.h"
#include "libmodel/core/progress.h"
#include "libregister/reference/reference_face.h"
#include "libregister/registration/appearance.h"
#include "pipelines/build_options.h"
#include "pipelines/output_tree.h"

namespace facewright {

struct LevelDecisionSummary {
  LevelCriterion criterion = LevelCriterion::deviation;  ///< that decided in the end
  bool kept = false;                                     ///< from an earlier run
  bool mean_as_reference = false;     ///< the reference has the shape of the faces' mean, not its own
  bool too_few_scans = false;         ///< could be registered: the reference itself decided
  std::vector<std::string> scans;     ///< whose faces were measured
  std::vector<std::string> left_out;  ///< tried, but could not be registered
};

struct LevelDecision {
  MultiresTemplate reference;
  FaceAppearance appearance;  ///< of the faces that decided; empty if fewer than three have colours
  LevelDecisionSummary summary;
};

/// Decides the model's hierarchy once for all scans and leaves it in OUT/hierarchy.json. Six scans, drawn by a hash of
/// their ids so that files that are no use do not change the draw, are registered coarsely on a uniform 4-8 mesh. With
/// the deviation criterion those edges are split first where these faces deviate most from the coarser surface, and
/// their mean becomes the reference's shape; what their colours have in common guides the registration. Fewer than
/// three usable scans, or a single level: the reference itself decides and keeps its shape. With `resume` an earlier
/// decision for the same reference, levels, criterion and options of the registration stands, whatever scans have come
/// or gone since; for a part of the scans there must be one, else InvalidInput is thrown. The result does not depend on
/// the number of threads.
LevelDecision decide_levels(const ReferenceFace& face, const std::vector<ScanFiles>& files,
                            const BuildPipelineOptions& options, const OutputTree& tree, const Progress& progress = {});

}  // namespace facewright
