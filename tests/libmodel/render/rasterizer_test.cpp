// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/rasterizer.h"

#include <gtest/gtest.h>

#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"

namespace facewright {
namespace {

/// Pixel = (x, -y) + b: +y up, as the head frame.
AffineCamera unit_camera(double s = 1, Eigen::Vector2d b = {0, 0}) {
  AffineCamera camera;
  camera.A << s, 0, 0, 0, -s, 0;
  camera.b = b;
  return camera;
}

Mesh triangle(Eigen::Vector3d a, Eigen::Vector3d b, Eigen::Vector3d c) {
  Mesh mesh;
  mesh.V.resize(3, 3);
  mesh.V << a.transpose(), b.transpose(), c.transpose();
  mesh.F.resize(1, 3);
  mesh.F << 0, 1, 2;
  return mesh;
}

/// A fan of triangles around a centre that covers a polygon exactly once.
Mesh random_fan(Random& random, int corners) {
  Mesh mesh;
  mesh.V = Vertices::Zero(corners + 1, 3);
  mesh.F.resize(corners, 3);
  for (int i = 0; i < corners; ++i) {
    const double a = 2 * 3.14159265358979 * i / corners;
    mesh.V.row(i) << std::round(20 * std::cos(a)), std::round(20 * std::sin(a)), 0;  // many points on pixel centres
    mesh.F.row(i) << i, (i + 1) % corners, corners;
  }
  mesh.V.row(corners) << random.index(7), random.index(7), 0;
  return mesh;
}

TEST(Rasterize, EveryInnerPixelBelongsToExactlyOneTriangle) {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Mesh fan = random_fan(random, 9 + trial);
    std::vector<int> hits(60 * 60, 0);
    const AffineCamera camera = unit_camera(1, {30, 30});
    for (Eigen::Index f = 0; f < fan.F.rows(); ++f) {
      const Raster one = rasterize(fan.V, fan.F.row(f), camera, {60, 60, false});
      for (size_t i = 0; i < hits.size(); ++i) hits[i] += one.triangle[i] >= 0;
    }
    const Raster all = rasterize(fan.V, fan.F, camera, {60, 60, false});
    for (size_t i = 0; i < hits.size(); ++i) {
      EXPECT_LE(hits[i], 1);
      EXPECT_EQ(hits[i] == 1, all.triangle[i] >= 0);
    }
    EXPECT_EQ(hits[30 * 60 + 30], 1);
  }
}

TEST(Rasterize, AlignedSquareCoversItsAreaAndKeepsTopAndLeftEdges) {
  Mesh square = triangle({0, 0, 0}, {4, 0, 0}, {4, 4, 0});
  square.V.conservativeResize(4, 3);
  square.V.row(3) << 0, 4, 0;
  square.F.conservativeResize(2, 3);
  square.F.row(1) << 0, 2, 3;
  const Raster raster = rasterize(square.V, square.F, unit_camera(1, {2, 8}), {12, 12, true});  // pixels x 2..6, y 4..8
  int covered = 0;
  for (const int f : raster.triangle) covered += f >= 0;
  EXPECT_EQ(covered, 16);
  EXPECT_GE(raster.triangle[raster.index(2, 4)], 0);
  EXPECT_LT(raster.triangle[raster.index(6, 8)], 0);
  EXPECT_LT(raster.triangle[raster.index(2, 8)], 0);
}

TEST(Rasterize, BarycentricCoordinatesReproduceThePixel) {
  Random random(2);
  const AffineCamera camera = unit_camera(3.7, {50, 50});
  const Mesh mesh = triangle({-9, -8, 3}, {11, -4, -20}, {2, 9, 7});
  const Raster raster = rasterize(mesh.V, mesh.F, camera, {100, 100, true});
  int covered = 0;
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 100; ++x) {
      const size_t at = raster.index(x, y);
      if (raster.triangle[at] < 0) continue;
      ++covered;
      Eigen::Vector3d p = Eigen::Vector3d::Zero();
      for (int k = 0; k < 3; ++k)
        p += double{raster.barycentric[at][static_cast<size_t>(k)]} * mesh.V.row(k).transpose();
      EXPECT_LT((camera.project(p) - Eigen::Vector2d(x, y)).norm(), 1e-4);  // float coordinates
      EXPECT_NEAR(raster.depth[at], p[2], 1e-4);
    }
  EXPECT_NEAR(covered, 0.5 * 3.7 * 3.7 * (20 * 17 - 11 * 4), 30);  // area, up to the boundary's pixels
}

TEST(Rasterize, NearerSurfaceWinsWhateverTheOrder) {
  const Mesh far = triangle({0, 0, -5}, {20, 0, -5}, {0, 20, -5}), near = triangle({0, 0, 5}, {20, 0, 5}, {0, 20, 5});
  Vertices V(6, 3);
  Faces F(2, 3);
  for (const bool near_first : {false, true}) {
    V << (near_first ? near : far).V, (near_first ? far : near).V;
    F << 0, 1, 2, 3, 4, 5;
    const Raster raster = rasterize(V, F, unit_camera(1, {2, 25}), {30, 30, true});
    EXPECT_EQ(raster.triangle[raster.index(5, 20)], near_first ? 0 : 1);
    EXPECT_FLOAT_EQ(raster.depth[raster.index(5, 20)], 5);
  }
}

TEST(Rasterize, BackfacesAreCulledOnRequestOnly) {
  const Mesh back = triangle({0, 0, 0}, {0, 20, 0}, {20, 0, 0});
  EXPECT_LT(rasterize(back.V, back.F, unit_camera(1, {2, 25}), {30, 30, true}).triangle[20 * 30 + 5], 0);
  EXPECT_EQ(rasterize(back.V, back.F, unit_camera(1, {2, 25}), {30, 30, false}).triangle[20 * 30 + 5], 0);
}

TEST(Rasterize, ShiftByWholePixelsShiftsThePicture) {
  Random random(3);
  Mesh mesh;
  mesh.V = Vertices::NullaryExpr(40, 3, [&] { return 16 * random.index(5) / 16.0 * random.index(9) / 8.0; });
  mesh.F = Faces::NullaryExpr(60, 3, [&] { return random.index(40); });
  const Raster a = rasterize(mesh.V, mesh.F, unit_camera(2, {20, 40}), {60, 60, false});
  const Raster b = rasterize(mesh.V, mesh.F, unit_camera(2, {23, 35}), {60, 60, false});
  for (int y = 0; y < 50; ++y)
    for (int x = 0; x < 50; ++x) EXPECT_EQ(a.triangle[a.index(x, y + 5)], b.triangle[b.index(x + 3, y)]);
}

TEST(Rasterize, HostileInputIsRefusedOrLeftOut) {
  Mesh mesh = triangle({0, 0, 0}, {20, 0, 0}, {0, 20, 0});
  EXPECT_THROW(rasterize(mesh.V, mesh.F, unit_camera(), {0, 10, true}), InvalidInput);
  EXPECT_THROW(rasterize(mesh.V, mesh.F, unit_camera(), {1 << 20, 10, true}), InvalidInput);
  mesh.F(0, 1) = 3;
  EXPECT_THROW(rasterize(mesh.V, mesh.F, unit_camera(), {10, 10, true}), InvalidInput);
  mesh.F(0, 1) = 1;
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
    mesh.V(0, 0) = bad;
    EXPECT_NO_THROW(rasterize(mesh.V, mesh.F, unit_camera(), {10, 10, false}));
  }
  mesh.V.row(0) = mesh.V.row(1);  // degenerate
  for (const int f : rasterize(mesh.V, mesh.F, unit_camera(1, {0, 25}), {30, 30, false}).triangle) EXPECT_EQ(f, -1);
}

TEST(RasterizeFlat, LowerIndexWinsWhereMapsOverlap) {
  TexCoords p(6, 2);
  p << 0, 0, 20, 0, 0, 20, 0, 0, 0, 20, 20, 0;
  Faces F(2, 3);
  F << 0, 1, 2, 3, 4, 5;
  EXPECT_EQ(rasterize_flat(p, F, 30, 30).triangle[5 * 30 + 5], 0);
}

}  // namespace
}  // namespace facewright
