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

FindLandmarksResult LandmarkerPool::find(const Mesh& mesh, const Image& texture, const FindLandmarksOptions& options) {
  ScanLandmarker landmarker = take();
  FindLandmarksResult result = landmarker.find(mesh, texture, options);
  const std::lock_guard lock(mutex_);
  free_.push_back(std::move(landmarker));
  return result;
}

}  // namespace facewright
