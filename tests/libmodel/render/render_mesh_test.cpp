// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/render_mesh.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/sampling.h"

namespace facewright {
namespace {

/// A unit grid in the plane z = 0, facing the viewer, n x n squares of 10 mm.
Mesh grid(int n) {
  Mesh mesh;
  mesh.V.resize((n + 1) * (n + 1), 3);
  mesh.uv.resize(mesh.V.rows(), 2);
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      mesh.V.row(j * (n + 1) + i) << 10 * i, 10 * j, 0;
      mesh.uv.row(j * (n + 1) + i) << i / double(n), j / double(n);
    }
  mesh.F.resize(2 * n * n, 3);
  for (int j = 0, f = 0; j < n; ++j)
    for (int i = 0; i < n; ++i, f += 2) {
      const int a = j * (n + 1) + i;
      mesh.F.row(f) << a, a + 1, a + n + 2;
      mesh.F.row(f + 1) << a, a + n + 2, a + n + 1;
    }
  return mesh;
}

TEST(RenderMesh, AlbedoOfAConstantColourIsThatColour) {
  Mesh mesh = grid(3);
  mesh.colours = Colours::Constant(mesh.V.rows(), 3, linear_from_srgb8(77));
  RenderOptions options;
  options.width = options.height = 50;
  options.shading = Shading::none;
  const Image image = render_mesh(mesh, frame_camera(mesh.V, 50, 50), options);
  EXPECT_EQ(image.channels, 3);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(image.pixel(25, 25)[k], 77);
  EXPECT_EQ(image.pixel(0, 0)[0], srgb8_from_linear(options.background[0]));
}

TEST(RenderMesh, TextureAtOneTexelPerPixelIsCopiedExactly) {
  const Mesh mesh = grid(4);
  Image texture(40, 40, 3);
  for (size_t i = 0; i < texture.data.size(); ++i) texture.data[i] = static_cast<std::uint8_t>(i * 37 % 256);
  OrthographicCamera camera;  // the 40 mm square covers pixel areas 5..44
  camera.t = {4.5, 44.5};
  RenderOptions options;
  options.width = options.height = 50;
  options.supersampling = 1;
  options.shading = Shading::none;
  const Image image = render_mesh(mesh, camera, options, texture);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40; ++x)
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(image.pixel(x + 5, y + 5)[k], texture.pixel(x, y)[k], 1);  // float weights
}

TEST(RenderMesh, TransparentTexelsShowTheColourBelow) {
  Mesh mesh = grid(2);
  mesh.colours = Colours::Constant(mesh.V.rows(), 3, linear_from_srgb8(200));
  RenderOptions options;
  options.width = options.height = 40;
  options.shading = Shading::none;
  const Image image = render_mesh(mesh, frame_camera(mesh.V, 40, 40), options, Image(8, 8, 4, 0));
  EXPECT_EQ(image.pixel(20, 20)[1], 200);
}

TEST(RenderMesh, CoverageBecomesAlpha) {
  const Mesh mesh = grid(1);
  OrthographicCamera camera;
  camera.t = {4.5, 20};  // upper and lower border in the middle of a pixel
  RenderOptions options;
  options.width = options.height = 30;
  options.transparent = true;
  options.supersampling = 2;
  const Image image = render_mesh(mesh, camera, options);
  EXPECT_EQ(image.pixel(10, 15)[3], 255);
  EXPECT_EQ(image.pixel(10, 10)[3], 128);
  EXPECT_EQ(image.pixel(10, 9)[3], 0);
  EXPECT_EQ(image.pixel(4, 15)[3], 0);
  EXPECT_EQ(image.pixel(5, 15)[3], 255);
}

TEST(RenderMesh, BytesDoNotDependOnTheNumberOfThreads) {
  Mesh mesh = grid(6);
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i) mesh.V(i, 2) = 10 * std::sin(double(i));
  RenderOptions options;
  options.width = options.height = 64;
  options.threads = 1;
  const auto camera = frame_camera(mesh.V, 64, 64, 0.3, 0.2);
  const Image one = render_mesh(mesh, camera, options);
  options.threads = 5;
  EXPECT_EQ(one.data, render_mesh(mesh, camera, options).data);
}

TEST(RenderMesh, StudioLightComesFromTheUpperLeft) {
  Mesh mesh = grid(1);
  RenderOptions options;
  options.width = options.height = 40;
  const auto brightness = [&](double yaw, double pitch) {
    return int{render_mesh(mesh, frame_camera(mesh.V, 40, 40, yaw, pitch), options).pixel(20, 20)[1]};
  };
  EXPECT_GT(brightness(-0.6, 0), brightness(0.6, 0));  // facing left against facing right
  EXPECT_GT(brightness(0, -0.6), brightness(0, 0.6));  // facing up against facing down
}

TEST(RenderMesh, RefusesBadOptionsAndMeshes) {
  Mesh mesh = grid(1);
  RenderOptions options;
  options.supersampling = 9;
  EXPECT_THROW(render_mesh(mesh, OrthographicCamera(), options), InvalidInput);
  options = {};
  options.width = 0;
  EXPECT_THROW(render_mesh(mesh, OrthographicCamera(), options), InvalidInput);
  mesh.F(0, 0) = 99;
  EXPECT_THROW(render_mesh(mesh, OrthographicCamera(), {}), InvalidInput);
}

TEST(SampleRgba, TransparentNeighboursDoNotBleed) {
  Image image(2, 1, 4, 0);
  image.pixel(0, 0)[0] = 255;
  image.pixel(0, 0)[3] = 255;
  const Eigen::Vector4d middle = sample_rgba(image, {0.5, 0});
  EXPECT_DOUBLE_EQ(middle[0], 1);
  EXPECT_DOUBLE_EQ(middle[3], 0.5);
}

TEST(TexelPosition, CentresMapToWholePixelsAndBack) {
  const Eigen::Vector2d uv = texture_coordinate(3, 7, 16, 32);
  EXPECT_NEAR((texel_position(uv, 16, 32) - Eigen::Vector2d(3, 7)).norm(), 0, 1e-12);
}

}  // namespace
}  // namespace facewright
