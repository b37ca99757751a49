// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/scan_picture.h"

#include <algorithm>

#include "libmodel/core/errors.h"
#include "libmodel/core/similarity.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/overlays.h"
#include "libmodel/render/render_mesh.h"

namespace facewright {
namespace {

constexpr Rgb kUsed = {20, 100, 220}, kRejected = {215, 25, 30};
constexpr double kRoom = 0.88;  // of the frame that the registered face may fill: hair and ears show around it

}  // namespace

Image scan_picture(const Scan& scan, const RegistrationResult& result, const MultiresTemplate& reference, int size) {
  if (size < 100 || size > 2000) throw InvalidInput("scan picture: expected a size of 100..2000 pixels");
  if (reference.levels.empty() || result.V.rows() != reference.V.rows())
    throw InvalidInput("scan picture: the registration does not have the reference's vertices");
  const Similarity head_from_scan = fit_similarity(result.V, reference.V);
  const Vertices face = head_from_scan.apply(result.V);
  OrthographicCamera camera = frame_camera(face, size, size);
  const Eigen::Vector2d middle = Eigen::Vector2d::Constant((size - 1) / 2.0);
  camera.s *= kRoom;
  camera.t = middle + kRoom * (camera.t - middle);
  Mesh mesh = scan.mesh;
  mesh.V = head_from_scan.apply(mesh.V);
  RenderOptions options;
  options.width = options.height = size;
  options.threads = 1;
  Image left = render_mesh(mesh, camera, options, scan.texture);
  options.use_colours = false;
  Image right = render_mesh(mesh, camera, options);
  const auto pixel = [&](const Eigen::Vector3d& p) { return camera.affine().project(head_from_scan * p); };
  const double dot = size / 110.0;
  const Landmarks registered = locate(reference.landmarks, result.V, reference.levels.front().F);
  for (const auto& [name, mark] : result.landmarks) {
    const auto& out = result.summary.landmarks_rejected;
    if (std::find(out.begin(), out.end(), name) != out.end()) continue;
    const auto there = registered.find(name);
    if (there != registered.end())
      draw_line(right, pixel(mark.position), pixel(there->second.position), kUsed, dot / 2);
    draw_disc(right, pixel(mark.position), dot, kUsed);
  }
  for (const std::string& name : result.summary.landmarks_rejected) {
    const auto mark = scan.landmarks.find(name);
    if (mark != scan.landmarks.end()) draw_cross(right, pixel(mark->second.position), 2.5 * dot, kRejected, dot);
  }
  return contact_sheet({left, right}, 2);
}

}  // namespace facewright
