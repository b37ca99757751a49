// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gtest/gtest.h>

#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/fitting/fit_landmarks.h"
#include "tests/libmodel/fitting/toy_model.h"

namespace facewright {
namespace {

OrthographicCamera camera_at(double yaw) { return {3, rotation({yaw, 0.08, -0.05}), {410, 390}}; }

/// Pictures of one person with `pixels` of noise.
struct Shoot {
  MorphableModel model = toy_model(20);
  Eigen::VectorXd truth;
  std::vector<ImageLandmarks> images;

  Shoot(std::uint64_t seed, const std::vector<double>& yaws, double pixels) {
    Random random(seed);
    truth = model.shape().draw_coefficients(random);
    for (const double yaw : yaws) {
      images.push_back(project_landmarks(model, model.instance(truth).V, camera_at(yaw).affine()));
      for (auto& [name, mark] : images.back())
        mark.position += pixels * Eigen::Vector2d(random.normal(), random.normal());
    }
  }
};

TEST(FitLandmarksMulti, WithOneImageIsFitLandmarks) {
  const Shoot shoot(1, {0.3}, 1);
  const FitResult one = fit_landmarks(shoot.model, shoot.images[0]);
  const MultiFitResult many = fit_landmarks_multi(shoot.model, shoot.images);
  EXPECT_EQ(one.shape_coefficients, many.shape_coefficients);
  EXPECT_EQ(one.camera.A, many.images[0].camera.A);
  EXPECT_EQ(one.summary.rms_px, many.images[0].summary.rms_px);
}

TEST(FitLandmarksMulti, SeveralViewsSayMoreThanOne) {
  double one = 0, three = 0, uncertain_one = 0, uncertain_three = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Shoot shoot(seed, {-0.5, 0, 0.5}, 3);
    FitOptions options;
    options.jaw = JawMode::fixed;
    const MultiFitResult all = fit_landmarks_multi(shoot.model, shoot.images, options);
    const FitResult front = fit_landmarks(shoot.model, shoot.images[1], options);
    one += (front.shape_coefficients - shoot.truth).squaredNorm();
    three += (all.shape_coefficients - shoot.truth).squaredNorm();
    uncertain_one += front.shape_covariance.trace();
    uncertain_three += all.shape_covariance.trace();
  }
  EXPECT_LT(three, 0.6 * one);
  EXPECT_LT(uncertain_three, 0.6 * uncertain_one);
}

TEST(FitLandmarksMulti, PosteriorVarianceIsTheErrorToExpect) {
  double error = 0, expected = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Shoot shoot(seed, {-0.4, 0.1, 0.5}, 4.5);
    FitOptions options;
    options.jaw = JawMode::fixed;
    options.jaw_factor = 1;
    options.sigma_px = 4.5;
    const MultiFitResult fit = fit_landmarks_multi(shoot.model, shoot.images, options);
    error += (fit.shape_coefficients - shoot.truth).squaredNorm();
    expected += fit.shape_covariance.trace();
  }
  EXPECT_NEAR(error / expected, 1, 0.2);  // 800 coefficients, not all independent
}

TEST(FitLandmarksMulti, RecoversAPlantedShapeWithoutPriorFromSeveralViews) {
  Shoot shoot(4, {-0.5, 0, 0.5}, 0);
  FitOptions options;
  options.lambda = 0;
  options.jaw = JawMode::fixed;
  options.tolerance = 1e-9;
  options.iterations = 500;
  const MultiFitResult fit = fit_landmarks_multi(shoot.model, shoot.images, options);
  EXPECT_EQ(fit.summary.stop, FitStop::converged);
  EXPECT_LT((fit.shape_coefficients - shoot.truth).cwiseAbs().maxCoeff(), 1e-5);
  for (const FitResult& image : fit.images) EXPECT_LT(image.summary.rms_px, 1e-5);
}

TEST(FitLandmarksMulti, AnImageThatCannotBeUsedIsNamedAndLeftOut) {
  Shoot shoot(5, {-0.3, 0.1, 0.4}, 0.5);
  const MultiFitResult good = fit_landmarks_multi(shoot.model, {shoot.images[0], shoot.images[2]});
  shoot.images[1] = {{"31", {}}, {"hat", {}}};
  const MultiFitResult fit = fit_landmarks_multi(shoot.model, shoot.images);
  EXPECT_EQ(fit.summary.used_images, 2);
  ASSERT_EQ(fit.summary.failed.size(), 1U);
  EXPECT_NE(fit.summary.failed.at(1).find("at least 4"), std::string::npos);
  EXPECT_EQ(fit.images[1].summary.stop, FitStop::not_run);
  EXPECT_EQ(fit.shape_coefficients, good.shape_coefficients);
}

TEST(FitLandmarksMulti, AnImageWhoseLandmarksWeighNothingIsNamedAndLeftOut) {
  Shoot shoot(5, {-0.3, 0.1, 0.4}, 0.5);
  for (auto& [name, mark] : shoot.images[1]) mark.stddev = 1e200;
  const MultiFitResult fit = fit_landmarks_multi(shoot.model, shoot.images);
  EXPECT_EQ(fit.summary.used_images, 2);
  EXPECT_EQ(fit.summary.failed.count(1), 1U);
}

TEST(FitLandmarksMulti, WithoutAnyUsableImageThrows) {
  const MorphableModel model = toy_model();
  EXPECT_THROW(fit_landmarks_multi(model, {}), InvalidInput);
  EXPECT_THROW(fit_landmarks_multi(model, {ImageLandmarks{}}), InvalidInput);
}

}  // namespace
}  // namespace facewright
