// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "libmodel/core/progress.h"
#include "libmodel/core/registered_set.h"
#include "pipelines/build_options.h"
#include "pipelines/landmark_stage.h"
#include "pipelines/level_decision.h"

namespace facewright {

/// How one scan fared.
struct ScanOutcome {
  std::string id;
  bool registered = false;
  bool kept = false;   ///< unchanged since an earlier run
  std::string reason;  ///< why not, and what to do
  std::string landmark_source;
  RegisterSummary summary;  ///< of registered scans made in this run
  double seconds = 0;
};

struct BuildPipelineSummary {
  std::vector<ScanOutcome> scans;  ///< in order of id
  LandmarkStageSummary landmarks;  ///< whose landmarks are used
  LevelDecisionSummary levels;     ///< how the hierarchy was decided
  int registered = 0, failed = 0;
  int shape_modes = 0, colour_modes = 0, expression_modes = 0;
  std::vector<std::string> blendshapes;       ///< names
  std::map<std::string, std::string> pruned;  ///< registered scans that are no part of the model, with the reason
  std::vector<std::string> without_neutral;   ///< people whose expressions could not be used
  std::vector<int> level_vertices;
  bool nothing_changed = false;  ///< with `resume`: an earlier build stands as it is, and no file was written
  std::vector<std::pair<std::string, double>> seconds;  ///< per stage, in order
};

/// A folder or manifest of scans to a model with its levels, exports and report, as `build-model` does it. A scan that
/// cannot be used ends in OUT/problematic/ID.txt with the reason and the others go on. With `resume`, or where a stage
/// or a part is asked for, finished work is verified and kept, wherever and by whomever it was done. Files are written
/// all or nothing; what `progress` throws ends the build between two scans, and what is finished stays. Throws
/// InvalidInput when too few scans are left, or a part is to be registered before the levels are decided; IoError when
/// the output cannot be written.
BuildPipelineSummary build_from_scans(const BuildPipelineOptions& options, const Progress& progress = {});

}  // namespace facewright
