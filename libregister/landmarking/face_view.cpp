// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/face_view.h"

#include <algorithm>
#include <cmath>

#include "libmodel/render/head_pose.h"
#include "libmodel/render/render_mesh.h"

namespace facewright {

OrthographicCamera view_camera(const Similarity& scan_from_head, const ViewAngle& angle,
                               const FaceViewOptions& options) {
  OrthographicCamera camera;
  camera.R = rotation({angle.yaw, angle.pitch, 0}) * scan_from_head.R.transpose();
  camera.s = options.size / options.field / scan_from_head.s;
  const double middle = (options.size - 1) / 2.0;
  const Eigen::Vector2d c = camera.affine().A * (scan_from_head * options.centre);
  camera.t = Eigen::Vector2d(middle, middle) - c;
  return camera;
}

FaceView look_at(const Mesh& mesh, const LinearImage* texture, const Similarity& scan_from_head, const ViewAngle& angle,
                 const FaceViewOptions& options) {
  FaceView view;
  view.camera = view_camera(scan_from_head, angle, options);
  RenderOptions render;
  render.width = render.height = options.size;
  render.use_colours = options.use_colour;
  render.threads = options.threads;
  view.image = texture ? render_mesh(mesh, view.camera, render, *texture) : render_mesh(mesh, view.camera, render);
  view.raster = rasterize(mesh.V, mesh.F, view.camera.affine(), {options.size, options.size});
  return view;
}

namespace {

Eigen::Vector3d place(const Raster& raster, const Mesh& mesh, size_t i) {
  const auto& b = raster.barycentric[i];
  return position({raster.triangle[i], {b[0], b[1], b[2]}}, mesh.V, mesh.F);
}

bool is_smooth(const Raster& raster, int x, int y, const BackProjectOptions& options) {
  float low = raster.depth[raster.index(x, y)], high = low;
  for (int dy = -options.disc; dy <= options.disc; ++dy)
    for (int dx = -options.disc; dx <= options.disc; ++dx) {
      if (dx * dx + dy * dy > options.disc * options.disc || !raster.inside(x + dx, y + dy)) continue;
      const size_t i = raster.index(x + dx, y + dy);
      if (raster.triangle[i] < 0) continue;
      low = std::min(low, raster.depth[i]);
      high = std::max(high, raster.depth[i]);
    }
  return high - low <= options.jump;
}

}  // namespace

std::optional<Eigen::Vector3d> back_project(const FaceView& view, const Mesh& mesh, const Eigen::Vector2d& pixel,
                                            const BackProjectOptions& options) {
  const Raster& raster = view.raster;
  const int left = static_cast<int>(std::floor(pixel.x())), top = static_cast<int>(std::floor(pixel.y()));
  const Eigen::Vector2d f = pixel - Eigen::Vector2d(left, top);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weight = 0;
  for (int dy = 0; dy < 2; ++dy)
    for (int dx = 0; dx < 2; ++dx) {
      const int x = left + dx, y = top + dy;
      if (!raster.inside(x, y) || raster.triangle[raster.index(x, y)] < 0) continue;
      if (!is_smooth(raster, x, y, options)) return {};
      const double w = (dx ? f.x() : 1 - f.x()) * (dy ? f.y() : 1 - f.y());
      sum += w * place(raster, mesh, raster.index(x, y));
      weight += w;
    }
  if (weight < 0.25) return {};
  return sum / weight;
}

}  // namespace facewright
