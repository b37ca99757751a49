// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/texture.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/geometry/normals.h"
#include "libmodel/render/rasterizer.h"
#include "libmodel/render/sampling.h"

namespace facewright {
namespace {

double smoothstep(double x, double low, double high) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// What the camera sees of a mesh: a z-buffer of its own resolution around the face.
class Visibility {
 public:
  Visibility(const Mesh& mesh, const AffineCamera& camera, const TextureOptions& options)
      : towards_camera_(camera.towards_camera()) {
    const TexCoords p = (mesh.V * camera.A.transpose()).rowwise() + camera.b.transpose();
    const Eigen::Vector2d low = p.colwise().minCoeff(), high = p.colwise().maxCoeff();
    const double scale = (options.depth_resolution - 5) / std::max((high - low).maxCoeff(), 1e-9);
    camera_.A = scale * camera.A;
    camera_.b = scale * (camera.b - low) + Eigen::Vector2d(2, 2);
    const Eigen::Vector2d size = scale * (high - low) + Eigen::Vector2d(5, 5);
    raster_ = rasterize(mesh.V, mesh.F, camera_, {static_cast<int>(size[0]), static_cast<int>(size[1]), false});
    const Eigen::VectorXd depth = mesh.V * towards_camera_;
    bias_ = options.depth_bias * (depth.maxCoeff() - depth.minCoeff());
    pixel_mm_ = 1 / std::sqrt(camera_.A.row(0).cross(camera_.A.row(1)).norm());
  }

  /// A point of the surface of unit normal n: nothing lies before it. The z-buffer's depth varies within a pixel by
  /// the slope of the surface, which is allowed for.
  bool sees(const Eigen::Vector3d& x, const Eigen::Vector3d& n) const {
    const double cosine = n.dot(towards_camera_);
    if (cosine <= 0) return false;
    const Eigen::Vector2d p = camera_.project(x);
    const int i = static_cast<int>(std::lround(p[0])), j = static_cast<int>(std::lround(p[1]));
    if (!raster_.inside(i, j)) return false;
    const double slope = std::min(std::sqrt(std::max(0.0, 1 - cosine * cosine)) / cosine, 6.0);
    const double nearest = raster_.depth[raster_.index(i, j)];  // -infinity where empty, just outside the outline
    return nearest - x.dot(towards_camera_) <= bias_ + 0.71 * pixel_mm_ * slope;
  }
  double cosine(const Eigen::Vector3d& n) const { return n.dot(towards_camera_); }

 private:
  AffineCamera camera_;
  Eigen::Vector3d towards_camera_;
  Raster raster_;
  double bias_ = 0, pixel_mm_ = 1;
};

/// Averages n x n samples over the footprint of one texel, spanned by the pixel steps to its right and lower neighbour.
class FootprintSampler {
 public:
  FootprintSampler(const Image& image, const Mesh& mesh, const Faces& corners, const AffineCamera& camera, int size)
      : image_(image), steps_(static_cast<size_t>(mesh.F.rows())) {
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
      Eigen::Matrix<double, 3, 2> E;  // edges of the triangle, mm
      Eigen::Matrix2d U;              // the same, in texture coordinates
      for (int k = 0; k < 2; ++k) {
        E.col(k) = (mesh.V.row(mesh.F(f, k + 1)) - mesh.V.row(mesh.F(f, 0))).transpose();
        U.col(k) = (mesh.uv.row(corners(f, k + 1)) - mesh.uv.row(corners(f, 0))).transpose();
      }
      const double det = U(0, 0) * U(1, 1) - U(0, 1) * U(1, 0);
      Eigen::Matrix2d step = Eigen::Matrix2d::Zero();
      if (std::abs(det) > 1e-14) {
        Eigen::Matrix2d inverse;
        inverse << U(1, 1), -U(0, 1), -U(1, 0), U(0, 0);
        step = camera.A * E * inverse / (det * size);
      }
      steps_[static_cast<size_t>(f)] = step;
    }
  }

  Eigen::Vector3d operator()(int f, const Eigen::Vector2d& p) const {
    const Eigen::Matrix2d& step = steps_[static_cast<size_t>(f)];
    const double reach = std::max(step.col(0).norm(), step.col(1).norm());
    const int n = std::clamp(static_cast<int>(std::ceil(reach)), 1, 8);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int k = 0; k < n * n; ++k) {
      const Eigen::Vector2d at((k % n + 0.5) / n - 0.5, (k / n + 0.5) / n - 0.5);
      sum += sample_linear(image_, p + step * at);
    }
    return sum / (n * n);
  }

 private:
  const Image& image_;
  std::vector<Eigen::Matrix2d> steps_;
};

void check(const Mesh& mesh, const Image& image, const TextureOptions& o) {
  validate(mesh);
  if (!mesh.has_uv()) throw InvalidInput("texture: the mesh has no texture coordinates; the model needs a UV map");
  if (image.empty()) throw InvalidInput("texture: the image is empty");
  if (o.size < 8 || o.size > 8192 || o.depth_resolution < 16 || o.depth_resolution > 8192)
    throw InvalidInput("texture options: expected size 8..8192 and depth_resolution 16..8192");
  if (!(o.hidden_cosine >= 0 && o.hidden_cosine < o.full_cosine && o.full_cosine <= 1 && o.depth_bias >= 0))
    throw InvalidInput("texture options: expected 0 <= hidden_cosine < full_cosine <= 1 and depth_bias >= 0");
}

bool inside(const Image& image, const Eigen::Vector2d& p) {
  return p[0] >= -0.5 && p[1] >= -0.5 && p[0] <= image.width - 0.5 && p[1] <= image.height - 0.5;
}

Raster texture_raster(const Mesh& mesh, const Faces& corners, int size) {
  TexCoords texels(mesh.uv.rows(), 2);
  for (Eigen::Index i = 0; i < mesh.uv.rows(); ++i)
    texels.row(i) = texel_position(mesh.uv.row(i).transpose(), size, size).transpose();
  return rasterize_flat(texels, corners, size, size);
}

void set(std::uint8_t* texel, const Eigen::Vector3d& linear, double alpha) {
  for (int k = 0; k < 3; ++k) texel[k] = srgb8_from_linear(linear[k]);
  texel[3] = static_cast<std::uint8_t>(std::lround(255 * alpha));
}

}  // namespace

TextureResult extract_texture(const Mesh& mesh, const Image& image, const AffineCamera& camera,
                              const TextureOptions& options) {
  check(mesh, image, options);
  const Faces& corners = mesh.uv_faces.rows() > 0 ? mesh.uv_faces : mesh.F;
  const Raster map = texture_raster(mesh, corners, options.size);
  const Vertices normals = vertex_normals(mesh.V, mesh.F);
  const Visibility visibility(mesh, camera, options);
  const FootprintSampler sample(image, mesh, corners, camera, options.size);
  TextureResult result;
  result.isomap = Image(options.size, options.size, 4);
  parallel_for(options.size, options.threads, [&](int y) {
    for (int x = 0; x < options.size; ++x) {
      const size_t at = map.index(x, y);
      const int f = map.triangle[at];
      if (f < 0) continue;
      const auto& b = map.barycentric[at];
      const auto mix = [&](const Vertices& rows) -> Eigen::Vector3d {
        return (b[0] * rows.row(mesh.F(f, 0)) + b[1] * rows.row(mesh.F(f, 1)) + b[2] * rows.row(mesh.F(f, 2)))
            .transpose();
      };
      const Eigen::Vector3d X = mix(mesh.V), n = mix(normals).normalized();
      const Eigen::Vector2d p = camera.project(X);
      const bool seen = inside(image, p) && visibility.sees(X, n);
      const double alpha = seen ? smoothstep(visibility.cosine(n), options.hidden_cosine, options.full_cosine) : 0;
      const bool filler = alpha == 0 && mesh.has_colours();
      if (alpha > 0 || filler) set(result.isomap.pixel(x, y), filler ? mix(mesh.colours) : sample(f, p), alpha);
    }
  });
  TextureSummary& summary = result.summary;
  for (size_t i = 0; i < map.triangle.size(); ++i) {
    if (map.triangle[i] < 0) continue;
    const int alpha = result.isomap.data[4 * i + 3];
    ++summary.mapped_texels;
    summary.visible_texels += alpha > 0;
    summary.mean_alpha += alpha / 255.0;
  }
  summary.mean_alpha /= std::max(summary.mapped_texels, 1);
  return result;
}

}  // namespace facewright
