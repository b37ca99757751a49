// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "libmodel/model/landmark_mapper.h"
#include "pipelines/fit_images/fit_scan_files.h"

namespace facewright {

struct ScanRecord {
  std::string json;            ///< all numbers of the fit; docs/fitting.md lists them
  double landmark_rms_mm = 0;  ///< of the landmarks that the model has, after the fit
};
ScanRecord scan_record(const FitScanFilesOptions& options, const MorphableModel& model, const LandmarkMapper& mapper,
                       const Landmarks& landmarks, const FitScanFilesSummary& summary);

}  // namespace facewright
