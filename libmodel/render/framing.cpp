// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/framing.h"

#include <algorithm>

#include "libmodel/core/errors.h"
#include "libmodel/render/head_pose.h"

namespace facewright {
namespace {

void paste(Image& sheet, const Image& image, int left, int top) {
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const std::uint8_t* from = image.pixel(x, y);
      std::uint8_t* to = sheet.pixel(left + x, top + y);
      const int alpha = image.channels == 4 ? from[3] : 255;
      for (int k = 0; k < 3; ++k) {
        const int value = from[image.channels == 1 ? 0 : k];
        to[k] = static_cast<std::uint8_t>((value * alpha + to[k] * (255 - alpha) + 127) / 255);
      }
    }
}

}  // namespace

OrthographicCamera frame_camera(const Vertices& V, int width, int height, double yaw, double pitch) {
  if (V.rows() == 0 || width <= 0 || height <= 0) throw InvalidInput("frame_camera: nothing to show, or no pixels");
  constexpr double margin = 0.05;
  OrthographicCamera camera;
  camera.R = rotation({yaw, pitch, 0});
  const Vertices X = V * camera.R.transpose();
  const Eigen::RowVector3d low = X.colwise().minCoeff(), high = X.colwise().maxCoeff();
  const Eigen::RowVector3d size = (high - low).cwiseMax(1e-9), centre = (high + low) / 2;
  camera.s = (1 - 2 * margin) * std::min(width / size[0], height / size[1]);
  camera.t = {(width - 1) / 2.0 - camera.s * centre[0], (height - 1) / 2.0 + camera.s * centre[1]};
  return camera;
}

Image contact_sheet(const std::vector<Image>& images, int columns) {
  if (images.empty() || columns < 1) throw InvalidInput("contact sheet: expected images and at least one column");
  int width = 1, height = 1;
  for (const Image& image : images) width = std::max(width, image.width), height = std::max(height, image.height);
  const int count = static_cast<int>(images.size()), used = std::min(columns, count), rows = (count + used - 1) / used;
  Image sheet(used * width, rows * height, 3, 255);
  for (int i = 0; i < count; ++i) {
    const Image& image = images[static_cast<size_t>(i)];
    paste(sheet, image, i % used * width + (width - image.width) / 2, i / used * height + (height - image.height) / 2);
  }
  return sheet;
}

}  // namespace facewright
