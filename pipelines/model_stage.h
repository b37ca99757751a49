// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "libmodel/building/build_model.h"
#include "libmodel/building/expressions.h"
#include "libmodel/io/manifest.h"
#include "pipelines/build_options.h"
#include "pipelines/output_tree.h"

namespace facewright {

struct ModelStageResult {
  BuildModelResult built;  ///< with expressions, if there are scans of them
  RegisteredSet scans;     ///< the neutral ones the model is made of; under a limit of memory a draw of them
  ExpressionSummary expressions;
  std::map<std::string, std::string> pruned;  ///< id to the reason, in words
  std::string card_markdown, card_json;
};

/// Registered scans as they lie on disk to a model. `entries` (one per registered scan, in order of id) say whose and
/// of what expression they are: identity is learnt from neutral scans alone; the others make expressions. With
/// `prune_quantile` scans whose shape is an outlier are left out and the model is made again. `left_out` goes to the
/// model card. Throws InvalidInput if too few neutral scans are left.
ModelStageResult model_stage(const std::vector<ManifestEntry>& entries,
                             const std::map<std::string, std::string>& left_out, const MultiresTemplate& reference,
                             const BuildPipelineOptions& options, const OutputTree& tree);

}  // namespace facewright
