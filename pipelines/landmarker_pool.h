// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <mutex>
#include <vector>

#include "libregister/intake/scan.h"
#include "libregister/landmarking/scan_landmarks.h"

namespace facewright {

/// The landmarker of a reference face; empty `predictor`: where Debian puts dlib's. Only the built-in face has colours:
/// it is painted as the people it was made of are, which pictures of coloured scans are compared with.
ScanLandmarker make_scan_landmarker(const MultiresTemplate& reference, bool is_built_in, LandmarkMethod method,
                                    const std::filesystem::path& predictor = {});

/// Landmarkers, made once and copied for each thread that asks at the same time.
class LandmarkerPool {
 public:
  explicit LandmarkerPool(ScanLandmarker first) : first_(std::move(first)) {}
  /// The head is looked for where the geometry of the scan's frame has put it, if it was asked (Scan::frame).
  FindLandmarksResult find(const Scan& scan, FindLandmarksOptions options);

 private:
  ScanLandmarker take();
  ScanLandmarker first_;
  std::mutex mutex_;
  std::vector<ScanLandmarker> free_;
};

}  // namespace facewright
