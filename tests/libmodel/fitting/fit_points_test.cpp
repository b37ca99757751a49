// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/fit_points.h"

#include <gtest/gtest.h>

#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/fitting/point_tree.h"
#include "tests/libmodel/fitting/toy_model.h"
#include "tests/support/matchers.h"

namespace facewright {
namespace {

const Similarity place{1, rotation({0.7, -0.3, 0.4}), {30, -400, 900}};

Landmarks marks(const MorphableModel& model, const Vertices& V) {
  Landmarks out;
  for (const auto& [name, mark] : model.landmarks()) out[name].position = V.row(mark.vertex).transpose();
  return out;
}

FitPointsOptions exact() {
  FitPointsOptions options;
  options.lambda = 1e-12;
  options.tolerance = 1e-12;
  options.iterations = 500;
  return options;
}

TEST(FitPoints, PlantedFacesComeBackExactly) {
  const MorphableModel model = toy_model();
  Random random(5);
  const Eigen::VectorXd c = model.shape().draw_coefficients(random);
  const FitPointsResult fit = fit_points(model, marks(model, place.apply(model.instance(c).V)), exact());
  EXPECT_EQ(fit.summary.stop, FitStop::converged);
  EXPECT_THAT(fit.shape_coefficients, MatrixNear(c, 1e-8));
  EXPECT_THAT(fit.scan_from_model.R, MatrixNear(place.R, 1e-9));
  EXPECT_LT(fit.summary.rms_mm, 1e-8);
}

TEST(FitPoints, FindsTheUnitWhereScaleIsFree) {
  const MorphableModel model = toy_model();
  Random random(6);
  const Eigen::VectorXd c = model.shape().draw_coefficients(random);
  Similarity metres = place;
  metres.s = 0.001;
  FitPointsOptions options = exact();
  options.scaling = Scaling::free;
  options.sigma_mm = 0.001;
  const FitPointsResult fit = fit_points(model, marks(model, metres.apply(model.instance(c).V)), options);
  EXPECT_THAT(fit.shape_coefficients, MatrixNear(c, 1e-6));
  EXPECT_NEAR(fit.scan_from_model.s, 0.001, 1e-10);
}

TEST(FitPoints, MovesWithTheLandmarks) {
  const MorphableModel model = toy_model();
  Random random(7);
  Landmarks here = marks(model, model.instance(model.shape().draw_coefficients(random)).V), there;
  for (auto& [name, mark] : here) {
    for (int k = 0; k < 3; ++k) mark.position[k] += random.normal();
    there[name].position = place * mark.position;
  }
  const FitPointsResult a = fit_points(model, here), b = fit_points(model, there);
  EXPECT_THAT(a.shape_coefficients, MatrixNear(b.shape_coefficients, 1e-8));
  EXPECT_THAT(b.scan_from_model.R, MatrixNear(place.R * a.scan_from_model.R, 1e-9));
}

TEST(FitPoints, ALandmarkThatIsSaidToBeUncertainHardlyCounts) {
  const MorphableModel model = toy_model();
  Random random(8);
  const Eigen::VectorXd c = model.shape().draw_coefficients(random);
  Landmarks seen = marks(model, model.instance(c).V);
  const Eigen::VectorXd clean = fit_points(model, seen).shape_coefficients;
  seen["31"].position += Eigen::Vector3d(0, 0, 30);
  const double trusted = (fit_points(model, seen).shape_coefficients - clean).norm();
  seen["31"].stddev = 1000;
  const double doubted = (fit_points(model, seen).shape_coefficients - clean).norm();
  EXPECT_LT(doubted, 0.1 * trusted);
}

TEST(FitPoints, SpreadOfCoefficientsMatchesRepeatedNoise) {
  const MorphableModel model = toy_model(4);
  const Vertices V = model.mean().V;
  Random random(9);
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(4);
  Eigen::VectorXd said;
  FitPointsOptions options;
  options.lambda = 1e-9;  // without a prior the posterior's spread is the estimate's
  options.sigma_mm = 2;
  constexpr int repeats = 200;
  for (int i = 0; i < repeats; ++i) {
    Landmarks seen = marks(model, V);
    for (auto& [name, mark] : seen)
      for (int k = 0; k < 3; ++k) mark.position[k] += 2 * random.normal();
    const FitPointsResult fit = fit_points(model, seen, options);
    sum += fit.shape_coefficients.array().square() / repeats;
    said = fit.coefficient_stddevs;
  }
  for (int m = 0; m < 4; ++m) EXPECT_NEAR(std::sqrt(sum[m]) / said[m], 1, 0.2);  // 4 standard errors of 200 draws
}

TEST(FitPoints, RefusesWhatCannotBeUsed) {
  const MorphableModel model = toy_model();
  Landmarks seen = marks(model, model.mean().V), two;
  two["31"] = seen["31"];
  two["37"] = seen["37"];
  two["nobody"].position = {1, 2, 3};
  two["38"].position.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THROW(fit_points(model, two), InvalidInput);
  Landmarks line;
  for (int k = 28; k <= 31; ++k) line[std::to_string(k)].position = {0, 0, static_cast<double>(k)};
  EXPECT_THROW(fit_points(model, line), InvalidInput);
  FitPointsOptions bad;
  bad.sigma_mm = 0;
  EXPECT_THROW(fit_points(model, seen, bad), InvalidInput);
  seen["nobody"].position = {1, 2, 3};
  EXPECT_THAT(fit_points(model, seen).summary.unknown, ::testing::ElementsAre("nobody"));
}

TEST(PointTree, AgreesWithLookingAtEveryPoint) {
  Random random(10);
  Vertices P(500, 3);
  for (Eigen::Index i = 0; i < P.size(); ++i) P.data()[i] = std::round(4 * random.normal()) / 2;  // with ties
  const PointTree tree(P);
  for (int q = 0; q < 200; ++q) {
    const Eigen::Vector3d x(random.normal(), random.normal(), random.normal());
    Eigen::Index best = 0;
    const double d = (P.rowwise() - x.transpose()).rowwise().squaredNorm().minCoeff(&best);
    const auto found = tree.nearest(x);
    EXPECT_EQ(found.row, best);
    EXPECT_DOUBLE_EQ(found.squared_distance, d);
    const auto five = tree.nearest(x, 5);
    ASSERT_EQ(five.size(), 5U);
    EXPECT_EQ(five[0].row, best);
    EXPECT_EQ(((P.rowwise() - x.transpose()).rowwise().squaredNorm().array() < five[4].squared_distance * (1 - 1e-12))
                      .count() <= 4,
              true);
    EXPECT_EQ(tree.nearest(x, std::sqrt(d) * 0.99).row, -1);
  }
  EXPECT_EQ(PointTree(Vertices(0, 3)).nearest(Eigen::Vector3d::Zero()).row, -1);
}

}  // namespace
}  // namespace facewright
