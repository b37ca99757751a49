// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/render_mesh.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/geometry/normals.h"
#include "libmodel/render/rasterizer.h"
#include "libmodel/render/sampling.h"

namespace facewright {
namespace {

const Eigen::Vector3d clay(0.50, 0.48, 0.46);

/// Light that arrives for a unit normal in camera axes (+x right, +y up, +z to the viewer); about 1 facing the viewer.
double studio_light(const Eigen::Vector3d& n) {
  static const Eigen::Vector3d key = Eigen::Vector3d(-0.45, 0.55, 0.75).normalized();
  static const Eigen::Vector3d fill = Eigen::Vector3d(0.75, 0.1, 0.45).normalized();
  const double hemisphere = 0.5 * (1 + n[1]);                      // sky above, floor below
  const double wrapped = std::max(0.0, (n.dot(key) + 0.1) / 1.1);  // a large soft box reaches around the edge
  return 0.10 + 0.26 * hemisphere + 0.95 * wrapped + 0.10 * std::max(0.0, n.dot(fill));
}

/// Everything a pixel needs.
class Shader {
 public:
  Shader(const Mesh& mesh, const OrthographicCamera& camera, const RenderOptions& options, const Image& texture)
      : mesh_(mesh), options_(options), texture_(texture) {
    if (options.shading == Shading::studio) normals_ = vertex_normals(mesh.V, mesh.F) * camera.R.transpose();
  }

  Eigen::Vector3d operator()(int f, const std::array<float, 3>& b) const {
    const Eigen::Vector3d colour = albedo(f, b);
    if (options_.shading == Shading::none) return colour;
    const Eigen::Vector3d n = interpolate(normals_, f, b).normalized();
    const Eigen::Vector3d face = (corner(f, 1) - corner(f, 0)).cross(corner(f, 2) - corner(f, 0));
    return facing_away(face) ? Eigen::Vector3d(0.25 * studio_light(-n) * colour)
                             : Eigen::Vector3d(studio_light(n) * colour);
  }
  void set_view(const Eigen::Vector3d& towards_camera) { towards_camera_ = towards_camera; }

 private:
  Eigen::Vector3d corner(int f, int k) const { return mesh_.V.row(mesh_.F(f, k)); }
  bool facing_away(const Eigen::Vector3d& n) const { return n.dot(towards_camera_) < 0; }

  Eigen::Vector3d interpolate(const Vertices& rows, int f, const std::array<float, 3>& b) const {
    return (b[0] * rows.row(mesh_.F(f, 0)) + b[1] * rows.row(mesh_.F(f, 1)) + b[2] * rows.row(mesh_.F(f, 2)))
        .transpose();
  }

  Eigen::Vector3d albedo(int f, const std::array<float, 3>& b) const {
    const bool coloured = options_.use_colours && mesh_.has_colours();
    const Eigen::Vector3d base = coloured ? interpolate(mesh_.colours, f, b) : clay;
    if (!options_.use_colours || texture_.empty() || !mesh_.has_uv()) return base;
    const Faces& corners = mesh_.uv_faces.rows() > 0 ? mesh_.uv_faces : mesh_.F;
    Eigen::Vector2d uv = Eigen::Vector2d::Zero();
    for (int k = 0; k < 3; ++k)
      uv += static_cast<double>(b[static_cast<size_t>(k)]) * mesh_.uv.row(corners(f, k)).transpose();
    const Eigen::Vector4d c = sample_rgba(texture_, texel_position(uv, texture_.width, texture_.height));
    return c[3] * c.head<3>() + (1 - c[3]) * base;
  }

  const Mesh& mesh_;
  const RenderOptions& options_;
  const Image& texture_;
  Vertices normals_;
  Eigen::Vector3d towards_camera_ = Eigen::Vector3d::UnitZ();
};

OrthographicCamera supersampled(const OrthographicCamera& camera, int n) {
  OrthographicCamera fine = camera;
  fine.s *= n;
  fine.t = (n * (camera.t.array() + 0.5) - 0.5).matrix();  // pixel centres are whole numbers
  return fine;
}

void check(const RenderOptions& options) {
  if (options.supersampling < 1 || options.supersampling > 4)
    throw InvalidInput("render: expected supersampling 1..4, got " + std::to_string(options.supersampling));
  if (options.width < 1 || options.height < 1 || options.width > 8192 || options.height > 8192)
    throw InvalidInput("render: expected a size of 1..8192 pixels, got " + std::to_string(options.width) + " x " +
                       std::to_string(options.height));
}

}  // namespace

Image render_mesh(const Mesh& mesh, const OrthographicCamera& camera, const RenderOptions& options,
                  const Image& texture) {
  check(options);
  validate(mesh);
  const int n = options.supersampling;
  const AffineCamera fine = supersampled(camera, n).affine();
  const Raster raster = rasterize(mesh.V, mesh.F, fine, {n * options.width, n * options.height, false});
  Shader shade(mesh, camera, options, texture);
  shade.set_view(fine.towards_camera());
  Image image(options.width, options.height, options.transparent ? 4 : 3);
  parallel_for(options.height, options.threads, [&](int y) {
    for (int x = 0; x < options.width; ++x) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      int covered = 0;
      for (int k = 0; k < n * n; ++k) {
        const size_t at = raster.index(n * x + k % n, n * y + k / n);
        if (raster.triangle[at] < 0) continue;
        sum += shade(raster.triangle[at], raster.barycentric[at]).cwiseMin(1);
        ++covered;
      }
      const double alpha = static_cast<double>(covered) / (n * n);
      const Eigen::Vector3d colour = options.transparent
                                         ? Eigen::Vector3d(sum / std::max(covered, 1))
                                         : Eigen::Vector3d(sum / (n * n) + (1 - alpha) * options.background);
      std::uint8_t* out = image.pixel(x, y);
      for (int k = 0; k < 3; ++k) out[k] = srgb8_from_linear(colour[k]);
      if (options.transparent) out[3] = static_cast<std::uint8_t>(std::lround(255 * alpha));
    }
  });
  return image;
}

}  // namespace facewright
