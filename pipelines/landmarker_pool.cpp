// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/landmarker_pool.h"

#include "libmodel/synthetic/appearance.h"

namespace facewright {

ScanLandmarker make_scan_landmarker(const MultiresTemplate& reference, bool is_built_in, LandmarkMethod method,
                                    const std::filesystem::path& predictor) {
  Colours colours;
  if (is_built_in) {
    const SkinPainter paint{Appearance{}};
    colours.resize(reference.V.rows(), 3);
    for (Eigen::Index i = 0; i < reference.V.rows(); ++i)
      colours.row(i) = paint(reference.V.row(i).transpose()).transpose();
  }
  return ScanLandmarker(reference, method, predictor, colours);
}

ScanLandmarker LandmarkerPool::take() {
  const std::lock_guard lock(mutex_);
  if (free_.empty()) return first_.copy();
  ScanLandmarker landmarker = std::move(free_.back());
  free_.pop_back();
  return landmarker;
}

FindLandmarksResult LandmarkerPool::find(const Scan& scan, FindLandmarksOptions options) {
  if (scan.frame && !scan.frame->mirrored && !scan.frame->summary.candidates.empty()) {
    Similarity head = scan.frame->summary.candidates.front().scan_from_head;
    head.s *= scan.mm_per_unit;
    head.t *= scan.mm_per_unit;
    options.scan_from_head = head;
  }
  ScanLandmarker landmarker = take();
  FindLandmarksResult result = landmarker.find(scan.mesh, scan.texture, options);
  const std::lock_guard lock(mutex_);
  free_.push_back(std::move(landmarker));
  return result;
}

}  // namespace facewright
