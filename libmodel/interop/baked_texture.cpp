// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/baked_texture.h"

#include <algorithm>
#include <string>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/render/rasterizer.h"
#include "libmodel/render/sampling.h"

namespace facewright {
namespace {

// Colour sums and their weight per texel.
struct Layer {
  int size = 0;
  std::vector<Eigen::Vector4d> texels;
  explicit Layer(int n) : size(n), texels(static_cast<size_t>(n) * static_cast<size_t>(n), Eigen::Vector4d::Zero()) {}
  Eigen::Vector4d& at(int x, int y) {
    return texels[static_cast<size_t>(y) * static_cast<size_t>(size) + static_cast<size_t>(x)];
  }
};

// Empty texels take the mean of the covered ones around them, from ever coarser layers.
void fill_empty(Layer& fine) {
  if (fine.size < 2) return;
  Layer coarse((fine.size + 1) / 2);
  for (int y = 0; y < fine.size; ++y)
    for (int x = 0; x < fine.size; ++x) coarse.at(x / 2, y / 2) += fine.at(x, y);
  for (Eigen::Vector4d& t : coarse.texels)
    if (t[3] > 0) t /= t[3];
  fill_empty(coarse);
  for (int y = 0; y < fine.size; ++y)
    for (int x = 0; x < fine.size; ++x)
      if (fine.at(x, y)[3] == 0) fine.at(x, y) = coarse.at(x / 2, y / 2);
}

}  // namespace

Image baked_texture(const Mesh& mesh, int size) {
  if (!mesh.has_colours() || mesh.uv.rows() != mesh.V.rows() || mesh.uv_faces.rows() > 0)
    throw InvalidInput("texture: needs a colour and a texture coordinate per vertex");
  if (size < 16 || size > 8192)
    throw InvalidInput("texture: size is " + std::to_string(size) + " pixels; expected 16 to 8192");
  TexCoords pixels(mesh.uv.rows(), 2);
  for (Eigen::Index v = 0; v < pixels.rows(); ++v)
    pixels.row(v) = texel_position(mesh.uv.row(v).transpose(), size, size).transpose();
  const Raster raster = rasterize_flat(pixels, mesh.F, size, size);
  Layer layer(size);
  for (size_t i = 0; i < layer.texels.size(); ++i)
    if (const int t = raster.triangle[i]; t >= 0) {
      Eigen::Vector3d colour = Eigen::Vector3d::Zero();
      for (int k = 0; k < 3; ++k)
        colour += double{raster.barycentric[i][static_cast<size_t>(k)]} * mesh.colours.row(mesh.F(t, k)).transpose();
      layer.texels[i] << colour, 1;
    }
  fill_empty(layer);
  Image image(size, size, 3);
  for (size_t i = 0; i < layer.texels.size(); ++i)
    for (size_t k = 0; k < 3; ++k)
      image.data[3 * i + k] = srgb8_from_linear(layer.texels[i][static_cast<Eigen::Index>(k)]);
  return image;
}

}  // namespace facewright
