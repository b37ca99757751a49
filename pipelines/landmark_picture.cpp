// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/landmark_picture.h"

#include <algorithm>
#include <iterator>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/head_pose.h"
#include "libmodel/render/overlays.h"
#include "libmodel/render/render_mesh.h"
#include "pipelines/picture_text.h"

namespace facewright {
namespace {

constexpr int kSize = 420, kLine = 22;
constexpr Rgb kInk{30, 30, 30}, kFound{220, 30, 30}, kRead{20, 120, 230};

Image text_strip(int width, const std::vector<std::string>& lines) {
  Image strip(width, 10 + kLine * static_cast<int>(std::max<size_t>(1, lines.size())), 3, 255);
  for (size_t i = 0; i < lines.size(); ++i) draw_text(strip, {10, 6 + kLine * static_cast<int>(i)}, lines[i], kInk);
  return strip;
}

// Breaks long lines at spaces.
std::vector<std::string> wrapped(const std::vector<std::string>& lines, int width) {
  std::vector<std::string> out;
  for (std::string rest : lines) {
    while (text_width(rest) > width - 20) {
      size_t end = rest.size();
      while (end != 0 && end != rest.npos && text_width(rest.substr(0, end)) > width - 20)
        end = rest.rfind(' ', end - 1);
      if (end == 0 || end == rest.npos) break;
      out.push_back(rest.substr(0, end));
      rest = rest.substr(end + 1);
    }
    out.push_back(rest);
  }
  return out;
}

Image below(const Image& upper, const Image& lower) {
  Image both(upper.width, upper.height + lower.height, 3, 255);
  std::copy(upper.data.begin(), upper.data.end(), both.data.begin());
  std::copy(lower.data.begin(), lower.data.end(), both.data.begin() + static_cast<std::ptrdiff_t>(upper.data.size()));
  return both;
}

void draw(Image& picture, const Landmarks& marks, const OrthographicCamera& camera, double radius, const Rgb& colour) {
  for (const auto& [name, mark] : marks) draw_disc(picture, camera.affine().project(mark.position), radius, colour);
}

OrthographicCamera camera_from(const Scan& scan, const FindLandmarksResult& result, double yaw) {
  const HeadPose pose{yaw, 0, 0};
  if (result.landmarks.empty()) {
    OrthographicCamera camera = frame_camera(scan.mesh.V, kSize, kSize, yaw, 0);
    return camera;
  }
  OrthographicCamera camera;
  const Similarity& S = result.scan_from_head;
  camera.R = rotation(pose) * S.R.transpose();
  camera.s = kSize / 230.0 / S.s;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& entry : result.landmarks)
    middle += entry.second.position / static_cast<double>(result.landmarks.size());
  camera.t = Eigen::Vector2d::Constant((kSize - 1) / 2.0) - camera.affine().A * middle;
  return camera;
}

}  // namespace

Image landmark_picture(const Scan& scan, const FindLandmarksResult& result, const std::vector<std::string>& lines,
                       int threads) {
  RenderOptions options;
  options.width = options.height = kSize;
  options.threads = 1;
  constexpr double kYaws[] = {-0.7, 0, 0.7};
  std::vector<Image> pictures(std::size(kYaws));
  parallel_for(static_cast<int>(pictures.size()), threads, [&](int i) {
    const OrthographicCamera camera = camera_from(scan, result, kYaws[i]);
    Image& picture = pictures[static_cast<size_t>(i)] = render_mesh(scan.mesh, camera, options, scan.texture);
    draw(picture, result.detected, camera, 1.6, kFound);
    draw(picture, result.landmarks, camera, 2.6, kRead);
  });
  const Image sheet = contact_sheet(pictures, 3);
  return below(sheet, text_strip(sheet.width, wrapped(lines, sheet.width)));
}

Image message_picture(const std::vector<std::string>& lines) {
  return text_strip(3 * kSize, wrapped(lines, 3 * kSize));
}

Image failure_picture(const std::filesystem::path& mesh, const std::vector<std::string>& lines) {
  try {
    ScanFiles files;
    files.mesh = mesh;
    files.units = Units::mm;
    return landmark_picture(load_scan(files), {}, lines);
  } catch (const IoError&) {
    return message_picture(lines);
  } catch (const InvalidInput&) {
    return message_picture(lines);
  }
}

}  // namespace facewright
