// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gtest/gtest.h>

#include <cmath>

#include "libmodel/building/colour_reliability.h"
#include "libmodel/building/colour_sampling.h"
#include "libmodel/building/gain_balance.h"
#include "libmodel/core/errors.h"
#include "planted.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

// A sheet of 40 x 40 mm with square cells of `step` mm.
Mesh sheet(double step) {
  const int cells = static_cast<int>(std::lround(40 / step));
  return plane_grid(cells, cells, 40, 40);
}

std::vector<NearestPoint> places_on(const Mesh& scan, const Vertices& at) {
  return SurfaceIndex(scan.V, scan.F).nearest(at);
}

Vertices some_points() {
  Vertices at(49, 3);
  for (int i = 0; i < 49; ++i) at.row(i) << 8 + 4 * (i % 7) + 0.3, 8 + 4.0 * (i / 7) + 0.2, 0;
  const Mesh m = sheet(4);
  at.rowwise() += m.V.colwise().minCoeff();
  return at;
}

double spread(const Colours& c) { return std::sqrt((c.array() - c.mean()).square().mean()); }

// How much of a pattern finer than the footprint is left, with footprints of 4 mm.
double remaining_texture(int texels, int cell) {
  Mesh scan = sheet(4);
  scan.uv = (scan.V.leftCols<2>().rowwise() - scan.V.leftCols<2>().colwise().minCoeff()) / 40;
  Image texture(texels, texels, 3);
  for (int y = 0; y < texels; ++y)
    for (int x = 0; x < texels; ++x)
      for (int c = 0; c < 3; ++c) texture.pixel(x, y)[c] = (x / cell + y / cell) % 2 ? 255 : 0;
  return spread(sample_colours(scan, texture, places_on(scan, some_points()), Eigen::VectorXd::Constant(49, 4)));
}

TEST(SampleColours, TextureOfAnyFinenessIsAveragedOverTheFootprint) {
  EXPECT_LT(remaining_texture(200, 2), 0.06) << "20 texels across";
  EXPECT_LT(remaining_texture(1000, 10), 0.06) << "100 texels across";
  EXPECT_LT(remaining_texture(1000, 3), 0.06);
}

TEST(SampleColours, DenseVerticesAreAveragedOverTheFootprint) {
  Mesh scan = sheet(0.25);
  Random random(1);
  scan.colours = 0.5 + 0.2 * testing::random_matrix(random, scan.V.rows(), 3).array();
  const auto places = places_on(scan, some_points());
  const Colours wide = sample_colours(scan, {}, places, Eigen::VectorXd::Constant(49, 4));
  const Colours narrow = sample_colours(scan, {}, places, Eigen::VectorXd::Constant(49, 0.1));
  EXPECT_LT(spread(wide), 0.03) << "some 200 vertices in a disc";
  EXPECT_GT(spread(narrow), 0.08) << "interpolated";
  EXPECT_NEAR(wide.mean(), 0.5, 0.01);
}

TEST(SampleColours, SparseVerticesAreInterpolated) {  // a linear colour comes back exactly
  Mesh scan = sheet(4);
  scan.colours = 0.01 * scan.V;
  const Vertices at = some_points();
  const Colours c = sample_colours(scan, {}, places_on(scan, at), Eigen::VectorXd::Constant(49, 0.5));
  EXPECT_LT((c - 0.01 * at).norm(), 1e-9);
}

TEST(SampleColours, WithoutColoursThereAreNone) {
  const Mesh scan = sheet(4);
  EXPECT_EQ(sample_colours(scan, {}, places_on(scan, some_points()), Eigen::VectorXd::Constant(49, 1)).size(), 0);
  EXPECT_THROW(sample_colours(scan, {}, places_on(scan, some_points()), Eigen::VectorXd::Constant(3, 1)), InvalidInput);
}

TEST(ColourReliability, IsFullOnTheScanAndFallsWithDistance) {
  const Mesh scan = sheet(2);
  Mesh face = plane_grid(10, 10, 24, 24);
  face.V.rowwise() += (scan.V.colwise().mean() - face.V.colwise().mean()).eval();
  double last = 1.1;
  for (const double height : {0.0, 1.5, 2.5, 4.0}) {
    Vertices V = face.V;
    V.col(2).array() += height;
    const Eigen::VectorXd w = colour_reliability(V, face.F, scan, places_on(scan, V));
    EXPECT_LT(w.maxCoeff() - w.minCoeff(), 1e-9);
    EXPECT_LT(w[0], last) << height;
    last = w[0];
    if (height == 0) {
      EXPECT_EQ(w.minCoeff(), 1);
    }
  }
  EXPECT_EQ(last, 0);
}

TEST(ColourReliability, FallsAtGrazingAnglesAndIsNothingFromBehind) {
  const Mesh scan = sheet(2);
  Mesh face = plane_grid(6, 6, 2, 2);
  const Eigen::RowVector3d centre = scan.V.colwise().mean();
  face.V.rowwise() -= face.V.colwise().mean().eval();
  double last = 1.1;
  for (const double degrees : {0.0, 55.0, 85.0, 180.0}) {
    const Eigen::Matrix3d R = Eigen::AngleAxisd(degrees / 57.29578, Eigen::Vector3d::UnitX()).toRotationMatrix();
    const Vertices V = (face.V * R.transpose()).rowwise() + centre;
    const double w = colour_reliability(V, face.F, scan, places_on(scan, V)).mean();
    EXPECT_LT(w, last) << degrees;
    last = std::max(w, 1e-9);
  }
}

TEST(ColourReliability, WhatLiesOverAHoleIsNotTrusted) {  // nearest places smear its rim
  Mesh scan = sheet(1);
  const Eigen::RowVector3d centre = scan.V.colwise().mean();
  std::vector<int> kept;
  for (int f = 0; f < scan.F.rows(); ++f)
    if ((scan.V.row(scan.F(f, 0)) - centre).norm() > 6) kept.push_back(f);
  scan.F = Faces(scan.F(kept, Eigen::all));
  Mesh face = plane_grid(20, 20, 30, 30);
  face.V.rowwise() += (centre - face.V.colwise().mean()).eval();
  const Eigen::VectorXd w = colour_reliability(face.V, face.F, scan, places_on(scan, face.V));
  for (Eigen::Index v = 0; v < face.V.rows(); ++v) {
    const double r = (face.V.row(v) - centre).norm();
    if (r < 5) {
      EXPECT_EQ(w[v], 0) << r;
    }
    if (r > 11 && (face.V.row(v) - centre).cwiseAbs().maxCoeff() < 15) {
      EXPECT_EQ(w[v], 1) << r;
    }
  }
}

TEST(ColourReliability, BridgedHolesAreNotTrusted) {  // two triangles span what the scanner did not see
  Mesh scan = sheet(1);
  const Eigen::RowVector3d centre = scan.V.colwise().mean();
  scan.F.conservativeResize(scan.F.rows() + 1, 3);
  scan.V.conservativeResize(scan.V.rows() + 3, 3);
  const auto n = static_cast<int>(scan.V.rows());
  scan.V.row(n - 3) = centre + Eigen::RowVector3d(-15, -15, 0.3);
  scan.V.row(n - 2) = centre + Eigen::RowVector3d(15, -15, 0.3);
  scan.V.row(n - 1) = centre + Eigen::RowVector3d(0, 15, 0.3);
  scan.F.bottomRows<1>() << n - 3, n - 2, n - 1;
  Mesh face = plane_grid(4, 4, 4, 4);
  face.V.rowwise() += (centre + Eigen::RowVector3d(0, 0, 0.3) - face.V.colwise().mean()).eval();
  EXPECT_EQ(colour_reliability(face.V, face.F, scan, places_on(scan, face.V)).maxCoeff(), 0);
}

SampleMatrix planted_gains(Random& random, Eigen::MatrixXd* gains, SampleMatrix* plain) {
  const Eigen::RowVectorXd mean = (0.3 + 0.2 * testing::random_matrix(random, 1, 600).array().tanh()).matrix();
  *gains = (0.3 * testing::random_matrix(random, 12, 3).array()).exp();
  SampleMatrix colours(12, 600);
  for (int s = 0; s < 12; ++s)
    for (int i = 0; i < 600; ++i) colours(s, i) = mean[i] * (1 + 0.01 * random.normal());
  *plain = colours;
  for (int s = 0; s < 12; ++s)
    for (int i = 0; i < 600; ++i) colours(s, i) *= (*gains)(s, i % 3);
  return colours;
}

TEST(GainBalance, FindsPlantedGainsDespiteBeards) {
  Random random(2);
  Eigen::MatrixXd gains;
  SampleMatrix plain;
  SampleMatrix colours = planted_gains(random, &gains, &plain);
  for (int s = 0; s < 12; s += 3) colours.row(s).head(150) *= 0.3;  // a quarter of the face
  const GainBalanceResult r = balance_gains(colours, {}, {.balance = GainBalance::channels});
  const Eigen::MatrixXd expected = gains.array().rowwise() / gains.array().log().colwise().mean().exp().eval();
  EXPECT_TRUE(r.converged);
  EXPECT_LT((r.gains.array() / expected.array() - 1).abs().maxCoeff(), 0.02);
  EXPECT_NEAR(r.gains.array().log().sum(), 0, 1e-9);
  for (int s = 0; s < 12; ++s)
    for (int i = 0; i < 600; ++i) EXPECT_EQ(r.colours(s, i), colours(s, i) / r.gains(s, i % 3));
}

TEST(GainBalance, ExposureIsOneGainAndKeepsTheHue) {
  Random random(3);
  Eigen::MatrixXd gains;
  SampleMatrix plain;
  const SampleMatrix colours = planted_gains(random, &gains, &plain);
  const GainBalanceResult r = balance_gains(colours, {}, {.balance = GainBalance::exposure});
  EXPECT_EQ(r.gains.col(0), r.gains.col(1));
  EXPECT_EQ(r.gains.col(0), r.gains.col(2));
}

TEST(GainBalance, UnseenValuesAreNotLookedAt) {
  Random random(4);
  Eigen::MatrixXd gains;
  SampleMatrix plain;
  SampleMatrix colours = planted_gains(random, &gains, &plain);
  SampleMatrix visibility = SampleMatrix::Ones(12, 200);
  visibility.leftCols(120).topRows(5).setZero();
  const GainBalanceResult before = balance_gains(colours, visibility, {.balance = GainBalance::channels});
  colours.topRows(5).leftCols(360).setConstant(0.9);
  EXPECT_EQ(balance_gains(colours, visibility, {.balance = GainBalance::channels}).gains, before.gains);
}

TEST(GainBalance, OffItChangesNothing) {
  Random random(5);
  Eigen::MatrixXd gains;
  SampleMatrix plain;
  const SampleMatrix colours = planted_gains(random, &gains, &plain);
  const GainBalanceResult r = balance_gains(colours, {});
  EXPECT_EQ(r.colours, colours);
  EXPECT_EQ(r.gains, Eigen::MatrixXd::Ones(12, 3));
  EXPECT_THROW(balance_gains(colours, SampleMatrix::Ones(2, 2)), InvalidInput);
}

}  // namespace
}  // namespace facewright
