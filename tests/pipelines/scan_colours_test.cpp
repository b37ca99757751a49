// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/scan_colours.h"

#include <gtest/gtest.h>

#include "tests/support/matchers.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

// Red grows with u, green with v (which runs up), in the encoding of files.
Image gradient(int size) {
  Image image(size, size, 3);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      image.pixel(x, y)[0] = srgb8_from_linear((x + 0.5) / size);
      image.pixel(x, y)[1] = srgb8_from_linear(1 - (y + 0.5) / size);
      image.pixel(x, y)[2] = 128;
    }
  return image;
}

// A sheet whose texture coordinates are its positions shrunk into the middle of the image.
Scan textured_sheet() {
  Scan scan;
  scan.mesh = plane_grid(10, 8, 100, 80);
  scan.mesh.uv = ((scan.mesh.V.leftCols<2>() / 100 * 0.8).array() + 0.1).matrix();
  scan.texture = gradient(256);
  return scan;
}

Colours expected_colours(const Scan& scan) {
  Colours c(scan.mesh.V.rows(), 3);
  c.leftCols<2>() = ((scan.mesh.V.leftCols<2>() / 100 * 0.8).array() + 0.1).matrix();
  c.col(2).setConstant(linear_from_srgb8(128));
  return c;
}

constexpr double kTolerance = 0.012;  // bytes are 0.9 % of the brightest apart, and a disc at the border is lopsided

TEST(ScanColours, AreTheTexturesAtTheVertices) {
  const Scan scan = textured_sheet();
  const Mesh m = mesh_with_colours(scan);
  EXPECT_THAT(m.colours, MatrixNear(expected_colours(scan), kTolerance));
  EXPECT_THAT(m.V, SameBytes(scan.mesh.V));
  EXPECT_TRUE(m.F == scan.mesh.F);
}

TEST(ScanColours, WedgeCoordinatesMeanTheSame) {
  const Scan plain = textured_sheet();
  Scan wedges = plain;
  wedges.mesh.uv.resize(3 * plain.mesh.F.rows(), 2);
  wedges.mesh.uv_faces.resize(plain.mesh.F.rows(), 3);
  for (int f = 0; f < plain.mesh.F.rows(); ++f)  // one row per corner, last corners first
    for (int k = 0; k < 3; ++k) {
      const int row = static_cast<int>(wedges.mesh.uv.rows()) - 1 - (3 * f + k);
      wedges.mesh.uv_faces(f, k) = row;
      wedges.mesh.uv.row(row) = plain.mesh.uv.row(plain.mesh.F(f, k));
    }
  EXPECT_THAT(mesh_with_colours(wedges).colours, MatrixNear(expected_colours(plain), kTolerance));
}

TEST(ScanColours, AreAveragedOverTheVertexsSurroundings) {  // a chessboard finer than the mesh is grey
  Scan scan = textured_sheet();
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 256; ++x)
      for (int c = 0; c < 3; ++c) scan.texture.pixel(x, y)[c] = (x / 3 + y / 3) % 2 ? 255 : 0;
  const Colours c = mesh_with_colours(scan).colours;
  const double spread = std::sqrt((c.array() - c.mean()).square().mean());
  EXPECT_NEAR(c.mean(), 0.5, 0.1);
  EXPECT_LT(spread, 0.3) << "of single texels: 0.5";
}

TEST(ScanColours, TheVerticesOwnAreKept) {
  Scan scan = textured_sheet();
  Random random(1);
  scan.mesh.colours = random_points(random, scan.mesh.V.rows(), 0.2).cwiseAbs();
  EXPECT_THAT(mesh_with_colours(scan).colours, SameBytes(scan.mesh.colours));
}

TEST(ScanColours, VerticesOfNoTriangleDoNoHarm) {
  Scan scan = textured_sheet();
  const Eigen::Index n = scan.mesh.V.rows();
  scan.mesh.V.conservativeResize(n + 1, 3);
  scan.mesh.V.row(n) << 500, 500, 500;
  scan.mesh.uv.conservativeResize(n + 1, 2);
  scan.mesh.uv.row(n) << 0.5, 0.5;
  const Mesh m = mesh_with_colours(scan);
  ASSERT_EQ(m.colours.rows(), n + 1);
  EXPECT_TRUE(m.colours.allFinite());
  EXPECT_THAT(m.colours.topRows(n), MatrixNear(expected_colours(textured_sheet()), kTolerance));
}

TEST(ScanColours, AreNoneWithoutTextureOrItsCoordinates) {
  Scan bare = textured_sheet();
  bare.mesh.uv.resize(0, 2);
  EXPECT_FALSE(mesh_with_colours(bare).has_colours());
  Scan dark = textured_sheet();
  dark.texture = {};
  EXPECT_FALSE(mesh_with_colours(dark).has_colours());
}

}  // namespace
}  // namespace facewright
