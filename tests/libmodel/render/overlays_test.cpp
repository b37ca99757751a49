// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/overlays.h"

#include <gtest/gtest.h>

#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/render/colour_maps.h"

namespace facewright {
namespace {

double ink(const Image& image) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) sum += image.pixel(x, y)[0] / 255.0;
  return sum;
}

TEST(Overlays, DiscAndLineCoverTheirArea) {
  Image image(60, 60, 3);
  draw_disc(image, {30.3, 29.6}, 10, {255, 255, 255});
  EXPECT_NEAR(ink(image), 3.14159 * 100, 3);
  image = Image(60, 60, 3);
  draw_line(image, {10, 10}, {50, 40}, {255, 255, 255}, 3);
  EXPECT_NEAR(ink(image), 3 * 50 + 3.14159 * 2.25, 5);  // length 50, round ends
}

TEST(Overlays, MarksOutsideOrNotFiniteAreClipped) {
  Image image(10, 10, 4);
  draw_disc(image, {-50, 5}, 3, {255, 0, 0});
  draw_disc(image, {1e12, 5}, 3, {255, 0, 0});
  draw_line(image, {-100, -100}, {-50, 200}, {255, 0, 0});
  draw_disc(image, {std::numeric_limits<double>::quiet_NaN(), 5}, 3, {255, 0, 0});
  EXPECT_EQ(ink(image), 0);
  draw_disc(image, {0, 0}, 3, {255, 0, 0});
  EXPECT_EQ(image.pixel(0, 0)[3], 255);
  Image grey(10, 10, 1);
  EXPECT_THROW(draw_disc(grey, {5, 5}, 3, {255, 0, 0}), InvalidInput);
}

TEST(Overlays, WireframeInksEdgesAndLeavesTheMiddleOfTrianglesFree) {
  Vertices V(3, 3);
  V << 0, 0, 0, 40, 0, 0, 0, 40, 0;
  Faces F(1, 3);
  F << 0, 1, 2;
  AffineCamera camera;
  camera.A << 1, 0, 0, 0, -1, 0;
  camera.b = {5, 45};
  Image image(60, 60, 3);
  draw_wireframe(image, V, F, camera, {255, 255, 255}, 1);
  EXPECT_EQ(image.pixel(15, 35)[0], 0);
  EXPECT_GT(image.pixel(5, 30)[0], 200);
}

TEST(Overlays, GreyBecomesRgb) {
  EXPECT_EQ(to_rgb(Image(2, 2, 1, 9)).pixel(1, 1)[2], 9);
  EXPECT_EQ(to_rgb(Image(2, 2, 4, 9)).channels, 3);
}

TEST(DivergingColours, AreSymmetricClampedAndNeutralAtZero) {
  Eigen::VectorXd values(6);
  values << -2, -1, 0, 1, 2, std::numeric_limits<double>::quiet_NaN();
  const Colours c = diverging_colours(values, 1);
  EXPECT_EQ(c.row(0), c.row(1));
  EXPECT_EQ(c.row(3), c.row(4));
  EXPECT_GT(c(1, 2), 2 * c(1, 0));  // blue
  EXPECT_GT(c(3, 0), 2 * c(3, 2));  // red
  EXPECT_GT(c.row(2).minCoeff(), 0.85);
  EXPECT_TRUE(c.allFinite());
  EXPECT_THROW(diverging_colours(values, 0), InvalidInput);
}

TEST(SequentialColours, GrowLighter) {
  const Colours c = sequential_colours(Eigen::VectorXd::LinSpaced(50, 0, 3), 3);
  for (int i = 1; i < 50; ++i)
    EXPECT_GT(c.row(i).dot(Eigen::RowVector3d(.21, .72, .07)), c.row(i - 1).dot(Eigen::RowVector3d(.21, .72, .07)));
}

}  // namespace
}  // namespace facewright
