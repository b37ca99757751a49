// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gtest/gtest.h>

#include <cmath>

#include "libmodel/core/random.h"
#include "libmodel/render/head_pose.h"
#include "libmodel/render/isomap_texels.h"
#include "libmodel/render/rasterizer.h"
#include "libmodel/render/render_mesh.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

PerspectiveCamera tilted_camera() {
  PerspectiveCamera camera;
  camera.R = rotation({0.9, 0.3, 0.2});
  camera.t = {-10, 5, -220};  // near: the far side is twice as far as the near one
  camera.focal_px = 300;
  camera.principal = {150, 140};
  return camera;
}

/// A plane of 160 x 160 mm about the origin.
Mesh plane(int n) {
  Mesh mesh = plane_grid(n, n, 160, 160);
  mesh.uv = mesh.V.leftCols<2>() / 160;
  mesh.V.rowwise() -= Eigen::RowVector3d(80, 80, 0);
  return mesh;
}

TEST(RasterizePerspective, InterpolatesOnTheSurfaceNotOnTheScreen) {
  const Mesh mesh = plane(1);
  const PerspectiveCamera camera = tilted_camera();
  const Raster raster = rasterize(project_vertices(mesh.V, camera), mesh.F, {300, 280, false});
  int covered = 0;
  for (int y = 0; y < 280; ++y)
    for (int x = 0; x < 300; ++x) {
      const size_t at = raster.index(x, y);
      const int f = raster.triangle[at];
      if (f < 0) continue;
      ++covered;
      Eigen::Vector3d X = Eigen::Vector3d::Zero();
      for (int k = 0; k < 3; ++k)
        X += double{raster.barycentric[at][static_cast<size_t>(k)]} * mesh.V.row(mesh.F(f, k)).transpose();
      // The ray through the pixel meets the plane z = 0 where this says.
      const Eigen::Vector3d ray =
          camera.R.transpose() *
          Eigen::Vector3d((x - camera.principal[0]) / camera.focal_px, (camera.principal[1] - y) / camera.focal_px, -1);
      const Eigen::Vector3d eye = -camera.R.transpose() * camera.t;
      EXPECT_LT((eye - eye[2] / ray[2] * ray - X).norm(), 2e-3);
      EXPECT_NEAR(raster.depth[at], -camera.depth(X), 2e-3);
    }
  EXPECT_GT(covered, 5000);
}

TEST(RasterizePerspective, WatertightOnRandomGrids) {
  Random random(4);
  Mesh mesh = plane(9);
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i)
    if (mesh.V.row(i).head<2>().cwiseAbs().maxCoeff() < 79)  // inner vertices move, the outline stays
      mesh.V.row(i) += Eigen::RowVector3d(random.uniform(-5, 5), random.uniform(-5, 5), 0);
  const Mesh outline = plane(1);
  const PerspectiveCamera camera = tilted_camera();
  const auto p = project_vertices(mesh.V, camera);
  const Raster all = rasterize(p, mesh.F, {300, 280, false});
  const Raster expected = rasterize(project_vertices(outline.V, camera), outline.F, {300, 280, false});
  std::vector<int> hits(all.triangle.size(), 0);
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    const Raster one = rasterize(p, mesh.F.row(f), {300, 280, false});
    for (size_t i = 0; i < hits.size(); ++i) hits[i] += one.triangle[i] >= 0;
  }
  int different = 0, inside = 0;
  for (size_t i = 0; i < hits.size(); ++i) {
    EXPECT_LE(hits[i], 1);
    EXPECT_EQ(hits[i] == 1, all.triangle[i] >= 0);
    inside += hits[i], different += (hits[i] == 1) != (expected.triangle[i] >= 0);
  }
  EXPECT_GT(inside, 5000);
  EXPECT_LE(different, 2);  // centres that fall on the outline, whose vertices are rounded elsewhere
}

TEST(RasterizePerspective, WhatIsBehindTheCameraIsLeftOut) {
  Mesh mesh = plane(2);
  PerspectiveCamera camera;
  camera.t = {0, 0, 100};
  camera.principal = {50, 50};
  for (const int f : rasterize(project_vertices(mesh.V, camera), mesh.F, {100, 100, false}).triangle) EXPECT_EQ(f, -1);
}

TEST(RenderPerspective, FarAwayItIsTheOrthographicPicture) {
  const Mesh mesh = plane(4);
  Image texture(64, 64, 3);
  for (size_t i = 0; i < texture.data.size(); ++i) texture.data[i] = static_cast<std::uint8_t>(i / 3 % 64 * 4);
  OrthographicCamera orthographic;
  orthographic.s = 0.5, orthographic.t = {50, 50};
  PerspectiveCamera far;
  far.focal_px = 0.5e6, far.t = {0, 0, -1e6}, far.principal = {50, 50};
  RenderOptions options;
  options.width = options.height = 101;
  const Image a = render_mesh(mesh, orthographic, options, texture), b = render_mesh(mesh, far, options, texture);
  for (size_t i = 0; i < a.data.size(); ++i) EXPECT_NEAR(a.data[i], b.data[i], 2);
}

TEST(RenderPerspective, TextureOfASlantedPlaneIsThatOfTheRays) {
  const Mesh mesh = plane(1);
  Image texture(256, 256, 3);
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 256; ++x)
      for (int k = 0; k < 3; ++k) texture.pixel(x, y)[k] = static_cast<std::uint8_t>(x);
  const PerspectiveCamera camera = tilted_camera();
  RenderOptions options;
  options.width = 300, options.height = 280, options.supersampling = 1, options.shading = Shading::none;
  const Image image = render_mesh(mesh, camera, options, texture);
  for (double x = -70; x <= 70; x += 10)
    for (double y = -70; y <= 70; y += 10) {
      const Eigen::Vector2d p = camera.project({x, y, 0});
      const int i = static_cast<int>(std::lround(p[0])), j = static_cast<int>(std::lround(p[1]));
      EXPECT_NEAR(image.pixel(i, j)[0], (x + 80) / 160 * 256, 5) << x << " " << y;  // half a pixel is up to 4 texels
    }
}

TEST(RenderMesh, FineTexturesAreAveragedNotSampled) {
  Mesh mesh = plane(2);
  Image texture(512, 512, 3);  // a checkerboard of single texels
  for (int y = 0; y < 512; ++y)
    for (int x = 0; x < 512; ++x)
      for (int k = 0; k < 3; ++k) texture.pixel(x, y)[k] = (x + y) % 2 ? 255 : 0;
  OrthographicCamera camera;
  camera.s = 0.4, camera.t = {40.3, 40.1};
  RenderOptions options;
  options.width = options.height = 80, options.supersampling = 1, options.shading = Shading::none;
  const Image image = render_mesh(mesh, camera, options, texture);
  for (int y = 20; y < 60; ++y)
    for (int x = 20; x < 60; ++x) EXPECT_NEAR(image.pixel(x, y)[0], srgb8_from_linear(0.5), 2);
}

TEST(IsomapTexels, CoverTheMapOnceAndRefuseMeshesWithoutCoordinates) {
  Mesh mesh = plane(5);
  const IsomapTexels map = isomap_texels(mesh, 64);
  EXPECT_EQ(map.count, 64 * 64);
  EXPECT_EQ(map.row_start.size(), 65U);
  EXPECT_ANY_THROW(isomap_texels(mesh, 1));
  mesh.uv.resize(0, 2);
  EXPECT_ANY_THROW(isomap_texels(mesh, 64));
}

}  // namespace
}  // namespace facewright
