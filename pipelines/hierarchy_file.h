// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <optional>
#include <string>

#include "pipelines/level_decision.h"

namespace facewright {

/// Leaves a decision in OUT/hierarchy.json; `key` says what it was made from. docs/file-formats.md
void write_decision(const LevelDecision& decision, const std::string& key, const OutputTree& tree);

/// The decision of an earlier run, if there is one for this key and criterion and its file is whole. One that was made
/// for want of usable scans is made again.
std::optional<LevelDecision> earlier_decision(const ReferenceFace& face, const std::string& key,
                                              const BuildPipelineOptions& options, const OutputTree& tree);

}  // namespace facewright
