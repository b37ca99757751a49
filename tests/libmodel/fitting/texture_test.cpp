// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/texture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/fitting/fit_model.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/render_mesh.h"
#include "libmodel/render/sampling.h"
#include "tests/libmodel/fitting/toy_model.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

/// A smooth pattern, a few dozen texels per wave.
Image pattern(int size) {
  Image image(size, size, 3);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const double u = 6.28 * x / size, v = 6.28 * y / size;
      image.pixel(x, y)[0] = static_cast<std::uint8_t>(130 + 90 * std::sin(7 * u));
      image.pixel(x, y)[1] = static_cast<std::uint8_t>(130 + 90 * std::cos(9 * v));
      image.pixel(x, y)[2] = static_cast<std::uint8_t>(130 + 90 * std::sin(5 * u + 4 * v));
    }
  return image;
}

Image photograph(const Mesh& mesh, const OrthographicCamera& camera, int size, const Image& texture) {
  RenderOptions options;
  options.width = options.height = size;
  options.shading = Shading::none;
  return render_mesh(mesh, camera, options, texture);
}

/// Peak signal-to-noise ratio of the isomap against the texture over texels of full alpha, decibel. The map's border is
/// left out: there the pixels of the photograph mix with its background.
double psnr(const Image& isomap, const Image& texture) {
  double sum = 0;
  int count = 0;
  for (int y = 40; y < isomap.height - 40; ++y)
    for (int x = 40; x < isomap.width - 40; ++x) {
      if (isomap.pixel(x, y)[3] < 255) continue;
      for (int k = 0; k < 3; ++k, ++count) {
        const double d = isomap.pixel(x, y)[k] - texture.pixel(x, y)[k];
        sum += d * d;
      }
    }
  return 10 * std::log10(255.0 * 255.0 * count / std::max(sum, 1e-9));
}

TEST(ExtractTexture, RoundTripThroughAPhotographKeepsVisibleTexels) {
  const MorphableModel model = toy_model();
  Random random(1);
  const Mesh mesh = model.sample(random);
  const Image texture = pattern(512);
  for (const double yaw : {-0.4, 0.0, 0.3}) {
    const OrthographicCamera camera = frame_camera(mesh.V, 1000, 1000, yaw);
    const TextureResult result = extract_texture(mesh, photograph(mesh, camera, 1000, texture), camera.affine());
    EXPECT_GT(psnr(result.isomap, texture), 35) << yaw;
    EXPECT_GT(result.summary.visible_texels, result.summary.mapped_texels / 2);
  }
}

TEST(ExtractTexture, HalfATexelOfOffsetWouldBeSeen) {  // guards the convention of texel centres
  const Mesh mesh = toy_model().mean();
  const Image texture = pattern(512);
  const OrthographicCamera camera = frame_camera(mesh.V, 1000, 1000);
  const Image isomap = extract_texture(mesh, photograph(mesh, camera, 1000, texture), camera.affine()).isomap;
  Image shifted = texture;
  for (int y = 0; y < 512; ++y)
    for (int x = 0; x < 511; ++x)
      for (int k = 0; k < 3; ++k) shifted.pixel(x, y)[k] = texture.pixel(x + 1, y)[k];
  EXPECT_GT(psnr(isomap, texture), psnr(isomap, shifted) + 10);
}

TEST(ExtractTexture, BackOfASphereIsHiddenAndItsEdgeFades) {
  Mesh sphere = icosphere(4, 80);
  sphere.uv.resize(sphere.V.rows(), 2);  // two hemispheres side by side, triangles across the seam left out
  Faces kept(sphere.F.rows(), 3);
  Eigen::Index n = 0;
  for (Eigen::Index f = 0; f < sphere.F.rows(); ++f) {
    const Eigen::Vector3d z(sphere.V(sphere.F(f, 0), 2), sphere.V(sphere.F(f, 1), 2), sphere.V(sphere.F(f, 2), 2));
    if (z.minCoeff() > 1 || z.maxCoeff() < -1) kept.row(n++) = sphere.F.row(f);
  }
  sphere.F = kept.topRows(n).eval();
  for (Eigen::Index i = 0; i < sphere.V.rows(); ++i) {
    const Eigen::RowVector3d x = sphere.V.row(i) / 80;
    sphere.uv.row(i) << (x[2] > 0 ? 0.25 + 0.24 * x[0] : 0.75 - 0.24 * x[0]), 0.5 + 0.45 * x[1];
  }
  const Image photo(400, 400, 3, 120);
  const Image isomap = extract_texture(sphere, photo, frame_camera(sphere.V, 400, 400).affine()).isomap;
  for (int y = 0; y < 512; ++y)
    for (int x = 0; x < 512; ++x) {
      const Eigen::Vector2d uv = texture_coordinate(x, y, 512, 512);
      const double r = std::hypot((uv[0] - 0.25) / 0.24, (uv[1] - 0.5) / 0.45);
      const int alpha = isomap.pixel(x, y)[3];
      if (uv[0] > 0.5) {
        EXPECT_EQ(alpha, 0);  // behind
      } else if (r < 0.8) {
        EXPECT_EQ(alpha, 255) << uv.transpose();  // n . v = sqrt(1 - r^2) > .6
      } else if (r > 0.995 && r < 1) {
        EXPECT_EQ(alpha, 0) << uv.transpose();  // n . v < .1
      }
    }
}

TEST(ExtractTexture, WhatLiesBehindSomethingNearerIsHidden) {
  Mesh mesh = plane_grid(8, 8, 80, 80);  // a wall, and a small plate 20 mm before its middle
  const Mesh plate = plane_grid(2, 2, 20, 20);
  const Eigen::Index n = mesh.V.rows();
  mesh.uv = mesh.V.leftCols<2>() / 160;
  Vertices V(n + plate.V.rows(), 3);
  V << mesh.V, plate.V.rowwise() + Eigen::RowVector3d(30, 30, 20);
  TexCoords uv(V.rows(), 2);
  uv << mesh.uv, (plate.V.leftCols<2>() / 160).rowwise() + Eigen::RowVector2d(0.6, 0.6);
  Faces F(mesh.F.rows() + plate.F.rows(), 3);
  F << mesh.F, plate.F.array() + static_cast<int>(n);
  mesh.V = V, mesh.uv = uv, mesh.F = F;
  const Image isomap = extract_texture(mesh, Image(300, 300, 3, 99), frame_camera(mesh.V, 300, 300).affine()).isomap;
  const auto alpha = [&](double x, double y) {
    const Eigen::Vector2d p = texel_position({x / 160, y / 160}, 512, 512);
    return int{isomap.pixel(static_cast<int>(std::lround(p[0])), static_cast<int>(std::lround(p[1])))[3]};
  };
  EXPECT_EQ(alpha(40, 40), 0);      // behind the plate
  EXPECT_EQ(alpha(10, 40), 255);    // beside it
  EXPECT_EQ(alpha(106, 106), 255);  // the plate itself
}

TEST(ExtractTexture, OutsideTheImageIsHiddenAndFilledFromTheMesh) {
  const Mesh mesh = toy_model().mean();
  OrthographicCamera camera = frame_camera(mesh.V, 600, 600);
  camera.t[0] -= 300;  // the subject's right half leaves the image
  const Image isomap = extract_texture(mesh, Image(600, 600, 3, 10), camera.affine()).isomap;
  EXPECT_EQ(isomap.pixel(150, 256)[3], 0);
  EXPECT_GT(isomap.pixel(150, 256)[0], 60);  // the mesh's colour, not the photograph's
  EXPECT_GT(isomap.pixel(350, 256)[3], 200);
  EXPECT_EQ(isomap.pixel(350, 256)[0], 10);
}

TEST(ExtractTexture, BytesDoNotDependOnTheNumberOfThreads) {
  const Mesh mesh = toy_model().mean();
  const OrthographicCamera camera = frame_camera(mesh.V, 300, 300, 0.3);
  TextureOptions one, many;
  one.threads = 1, many.threads = 4;
  EXPECT_EQ(extract_texture(mesh, pattern(300), camera.affine(), one).isomap.data,
            extract_texture(mesh, pattern(300), camera.affine(), many).isomap.data);
}

TEST(ExtractTexture, RefusesMeshesWithoutCoordinatesAndBadOptions) {
  Mesh mesh = toy_model().mean();
  const AffineCamera camera = frame_camera(mesh.V, 100, 100).affine();
  TextureOptions options;
  options.size = 0;
  EXPECT_THROW(extract_texture(mesh, pattern(100), camera, options), InvalidInput);
  EXPECT_THROW(extract_texture(mesh, Image(), camera), InvalidInput);
  mesh.uv.resize(0, 2);
  EXPECT_THROW(extract_texture(mesh, pattern(100), camera), InvalidInput);
}

TEST(FitModel, FrontalViewOfATurnedFaceShowsItsTexture) {
  const MorphableModel model = toy_model();
  Random random(4);
  const Eigen::VectorXd c = model.shape().draw_coefficients(random);
  const Mesh truth = model.instance(c);
  const OrthographicCamera camera = frame_camera(truth.V, 800, 800, 0.3);
  const Image photo = photograph(truth, camera, 800, pattern(512));
  const FitModelResult result = fit_model(model, photo, project_landmarks(model, truth.V, camera.affine()));
  const Image expected = frontal_view(truth, pattern(512), 512);
  ASSERT_EQ(result.frontal.width, 512);
  double difference = 0;
  int count = 0;
  for (int y = 150; y < 350; ++y)
    for (int x = 150; x < 350; ++x, ++count)
      difference += std::abs(result.frontal.pixel(x, y)[1] - expected.pixel(x, y)[1]);
  EXPECT_LT(difference / count, 20);  // of 255, a shift of 1 mm on the pattern is about 10
  EXPECT_EQ(result.overlay.width, photo.width);
  EXPECT_NE(result.overlay.data, photo.data);
}

}  // namespace
}  // namespace facewright
