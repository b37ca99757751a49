// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/relief_landmarks.h"

#include <algorithm>

#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

FaceView shape_view(const Mesh& mesh, const OrthographicCamera& camera, int size) {
  FaceView view;
  view.camera = camera;
  view.raster = rasterize(mesh.V, mesh.F, camera.affine(), {size, size});
  return view;
}

}  // namespace

std::vector<Landmarks> relief_landmarks(const Mesh& scan, const BentReference& reference,
                                        const Similarity& scan_from_head, const std::vector<ViewAngle>& angles,
                                        const FaceViewOptions& view, const PatchMatchOptions& options,
                                        const ReliefOptions& shape) {
  constexpr double kLeast = 0.4;  // correlation: less is no likeness
  std::vector<Landmarks> found(angles.size());
  const double mm_per_pixel = view.field / view.size, mm_per_depth = 1 / scan_from_head.s;
  parallel_for(static_cast<int>(angles.size()), view.threads, [&](int i) {
    const OrthographicCamera camera = view_camera(scan_from_head, angles[static_cast<size_t>(i)], view);
    const FaceView seen = shape_view(scan, camera, view.size), pattern = shape_view(reference.mesh, camera, view.size);
    const Relief scan_relief = relief(seen.raster, mm_per_pixel, mm_per_depth, shape);
    const Relief pattern_relief = relief(pattern.raster, mm_per_pixel, mm_per_depth, shape);
    Landmarks& side = found[static_cast<size_t>(i)];
    for (const auto& [name, mark] : reference.marks) {
      const Eigen::Vector2d pixel = camera.affine().project(mark.position);
      const auto shown = back_project(pattern, reference.mesh, pixel, {1, 6});
      if (!shown || (*shown - mark.position).norm() > 4) continue;  // hidden from this side
      const auto match = match_relief(pattern_relief, scan_relief, pixel, mm_per_pixel, options);
      if (!match || match->correlation < kLeast) continue;
      if (const auto place = back_project(seen, scan, pixel + match->offset, {1, 6}))
        side[name] = {*place, 1 + 6 * (1 - match->correlation)};
    }
  });
  return found;
}

}  // namespace facewright
