// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "libmodel/core/progress.h"
#include "libregister/reference/reference_face.h"
#include "pipelines/build_options.h"
#include "pipelines/output_tree.h"

namespace facewright {

struct LandmarkStageSummary {
  int given = 0;      ///< scans whose own file has all of ibug's inner landmarks, 18 to 68
  int completed = 0;  ///< whose file lacked some of them, which were found
  int found = 0;      ///< without a file
  int by_hand = 0;    ///< whose file in OUT/landmarks is not one that was found: somebody's corrections
  std::map<std::string, std::string> failed;  ///< scans without landmarks: why none could be found
};

/// Sees to it that every scan has landmarks: those of OUT/landmarks/ID.json if somebody has written or corrected that
/// file; else those beside the scan; and for names of 18 to 68 that are missing there, the ones found on the scan, with
/// their standard deviations. What was found is written to OUT/landmarks (ID.json in the scan's units, ID.png), which
/// `files` then name. With `resume` what was found on an unchanged scan is kept.
LandmarkStageSummary landmark_stage(std::vector<ScanFiles>* files, const ReferenceFace& reference,
                                    const BuildPipelineOptions& options, const OutputTree& tree,
                                    const Progress& progress);

}  // namespace facewright
