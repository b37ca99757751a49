// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/texture_atlas.h"

#include <algorithm>
#include <cmath>

namespace facewright {
namespace {

constexpr int kStrip = 4;  // pixels of grey at the right

void copy_rgb(const Image& from, int left, Image* to) {
  for (int y = 0; y < from.height; ++y)
    for (int x = 0; x < from.width; ++x)
      for (int c = 0; c < 3; ++c) to->pixel(left + x, y)[c] = from.pixel(x, y)[from.channels >= 3 ? c : 0];
}

}  // namespace

Image merge_pictures(const std::vector<Image>& pictures, const std::vector<int>& of_triangle, Mesh* mesh) {
  int width = kStrip, height = 1;
  std::vector<int> left;
  for (const Image& picture : pictures) {
    left.push_back(width - kStrip);
    width += picture.width, height = std::max(height, picture.height);
  }
  Image atlas(width, height, 3, 128);
  for (size_t i = 0; i < pictures.size(); ++i) copy_rgb(pictures[i], left[i], &atlas);
  const Faces& T = mesh->uv_faces.rows() > 0 ? mesh->uv_faces : mesh->F;
  TexCoords uv(3 * mesh->F.rows(), 2);
  Faces uv_faces(mesh->F.rows(), 3);
  for (Eigen::Index f = 0; f < uv_faces.rows(); ++f) {
    const int picture = of_triangle[static_cast<size_t>(f)];
    Eigen::RowVector2d tile = Eigen::RowVector2d::Zero();
    for (int k = 0; k < 3; ++k) tile += mesh->uv.row(T(f, k)) / 3;
    tile = tile.array().floor();
    for (int k = 0; k < 3; ++k) {
      const Eigen::Index row = 3 * f + k;
      uv_faces(f, k) = static_cast<int>(row);
      if (picture < 0 || pictures[static_cast<size_t>(picture)].empty()) {
        uv.row(row) << 1 - kStrip / 2.0 / width, 0.5;
        continue;
      }
      const Image& image = pictures[static_cast<size_t>(picture)];
      const Eigen::RowVector2d p = mesh->uv.row(T(f, k)) - tile;
      uv.row(row) << (left[static_cast<size_t>(picture)] + p[0] * image.width) / width,
          1 - (1 - p[1]) * image.height / height;
    }
  }
  mesh->uv = std::move(uv), mesh->uv_faces = std::move(uv_faces);
  return atlas;
}

}  // namespace facewright
