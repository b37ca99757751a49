// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/fit_landmarks.h"

#include <gtest/gtest.h>

#include <limits>

#include "libmodel/core/errors.h"
#include "tests/libmodel/fitting/toy_model.h"

namespace facewright {
namespace {

constexpr double degree = 0.017453292519943295;

OrthographicCamera camera_at(double yaw_deg) { return {3.2, rotation({yaw_deg * degree, 0.08, -0.05}), {410, 390}}; }

struct Person {
  Eigen::VectorXd coefficients;
  Mesh mesh;
};
Person person(const MorphableModel& model, std::uint64_t seed) {
  Random random(seed);
  const Eigen::VectorXd c = model.shape().draw_coefficients(random);
  return {c, model.instance(c)};
}

double rms(const Vertices& A, const Vertices& B) { return std::sqrt((A - B).rowwise().squaredNorm().mean()); }

TEST(FitLandmarks, RenderedFacesComeBackWithinTheContract) {
  const MorphableModel model = toy_model();
  for (const double yaw : {-25.0, -10.0, 0.0, 15.0, 25.0})
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const Person truth = person(model, seed);
      const OrthographicCamera camera = camera_at(yaw);
      const FitResult fit = fit_landmarks(model, project_landmarks(model, truth.mesh.V, camera.affine()));
      EXPECT_EQ(fit.summary.stop, FitStop::converged);
      EXPECT_LT(fit.summary.rms_percent, 1.5);
      EXPECT_NEAR(fit.pose.yaw, yaw * degree, 2 * degree);  // the prior trades some pose for shape
      const Mesh found = model.instance(fit.shape_coefficients);
      EXPECT_LT(rms(found.V, truth.mesh.V), 0.67 * rms(model.mean().V, truth.mesh.V));
    }
}

TEST(FitLandmarks, WithoutPriorAndWithFixedJawTheFitIsNearlyExact) {
  const MorphableModel model = toy_model(5);
  const Person truth = person(model, 5);
  FitOptions options;
  options.lambda = 1e-6;
  options.jaw = JawMode::fixed;
  options.iterations = 5000;
  options.tolerance = 1e-7;
  const FitResult fit = fit_landmarks(model, project_landmarks(model, truth.mesh.V, camera_at(20).affine()), options);
  EXPECT_LT(fit.summary.rms_px, 0.05);
  EXPECT_NEAR(fit.pose.yaw, 20 * degree, 0.5 * degree);
}

TEST(FitLandmarks, MovesWithTheImageAndIgnoresItsScale) {
  const MorphableModel model = toy_model();
  const Person truth = person(model, 6);
  const ImageLandmarks marks = project_landmarks(model, truth.mesh.V, camera_at(12).affine());
  ImageLandmarks moved = marks;
  for (auto& [name, mark] : moved) mark.position = 2.5 * mark.position + Eigen::Vector2d(300, -40);
  const FitResult a = fit_landmarks(model, marks), b = fit_landmarks(model, moved);
  EXPECT_LT((a.shape_coefficients - b.shape_coefficients).norm(), 1e-6);
  EXPECT_NEAR(b.orthographic.s, 2.5 * a.orthographic.s, 1e-6);
  EXPECT_LT((b.camera.b - 2.5 * a.camera.b - Eigen::Vector2d(300, -40)).norm(), 1e-4);
  EXPECT_NEAR(a.summary.rms_percent, b.summary.rms_percent, 1e-6);
}

TEST(FitLandmarks, SlidingJawPointsDoNoHarmWhenMovedAlongTheJaw) {
  const MorphableModel model = toy_model();
  const Person truth = person(model, 7);
  ImageLandmarks marks = project_landmarks(model, truth.mesh.V, camera_at(0).affine());
  const FitResult clean = fit_landmarks(model, marks);
  const ImageLandmarks original = marks;
  for (int k = 2; k <= 15; ++k) {  // a quarter of the way to the next one
    const Eigen::Vector2d here = original.at(std::to_string(k)).position,
                          next = original.at(std::to_string(k + 1)).position;
    marks[std::to_string(k)].position += 0.25 * (next - here);
  }
  const FitResult slid = fit_landmarks(model, marks);
  FitOptions fixed;
  fixed.jaw = JawMode::fixed;
  const double sliding = (slid.shape_coefficients - clean.shape_coefficients).norm();
  const double fixed_change =
      (fit_landmarks(model, marks, fixed).shape_coefficients - fit_landmarks(model, original, fixed).shape_coefficients)
          .norm();
  EXPECT_LT(sliding, 0.6 * fixed_change);
}

TEST(FitLandmarks, TheHiddenSideOfTheJawIsDropped) {
  const MorphableModel model = toy_model();
  const Person truth = person(model, 8);
  const FitResult fit = fit_landmarks(model, project_landmarks(model, truth.mesh.V, camera_at(25).affine()));
  for (const LandmarkResidual& r : fit.summary.residuals) {
    if (r.name == "13") {
      EXPECT_FALSE(r.used);
    }  // the subject's left, turned away
    if (r.name == "5") {
      EXPECT_TRUE(r.used);
    }
    if (r.name == "31") {
      EXPECT_TRUE(r.used);
    }
  }
}

TEST(FitLandmarks, StandardDeviationsOfTheFileCount) {
  const MorphableModel model = toy_model();
  const Person truth = person(model, 9);
  ImageLandmarks marks = project_landmarks(model, truth.mesh.V, camera_at(5).affine());
  const FitResult clean = fit_landmarks(model, marks);
  marks["31"].position += Eigen::Vector2d(40, 40);
  const double trusted = (fit_landmarks(model, marks).shape_coefficients - clean.shape_coefficients).norm();
  marks["31"].stddev = 200;
  const double doubted = (fit_landmarks(model, marks).shape_coefficients - clean.shape_coefficients).norm();
  EXPECT_LT(doubted, 0.2 * trusted);
}

TEST(FitLandmarks, AffineCameraIsAvailableAndReportsItsNeighbour) {
  const MorphableModel model = toy_model();
  FitOptions options;
  options.camera = CameraKind::affine;
  const FitResult fit =
      fit_landmarks(model, project_landmarks(model, person(model, 10).mesh.V, camera_at(10).affine()), options);
  EXPECT_LT(fit.summary.rms_percent, 1.5);
  EXPECT_LT((fit.orthographic.affine().A - fit.camera.A).norm() / fit.camera.A.norm(), 0.2);
}

TEST(FitLandmarks, UnknownAndUnusableLandmarksAreNamed) {
  const MorphableModel model = toy_model();
  ImageLandmarks marks = project_landmarks(model, model.mean().V, camera_at(0).affine());
  marks["hat"].position = {1, 2};
  marks["31"].position[0] = std::numeric_limits<double>::quiet_NaN();
  const FitResult fit = fit_landmarks(model, marks);
  EXPECT_EQ(fit.summary.unknown, (std::vector<std::string>{"31", "hat"}));
}

TEST(FitLandmarks, TooFewLandmarksAndBadOptionsAreRefused) {
  const MorphableModel model = toy_model();
  const ImageLandmarks all = project_landmarks(model, model.mean().V, camera_at(0).affine());
  const ImageLandmarks three = {{"31", all.at("31")}, {"37", all.at("37")}, {"46", all.at("46")}};
  EXPECT_THROW(fit_landmarks(model, three), InvalidInput);
  EXPECT_THROW(fit_landmarks(model, {}), InvalidInput);
  FitOptions options;
  options.lambda = -1;
  EXPECT_THROW(fit_landmarks(model, all, options), InvalidInput);
  options = {};
  options.iterations = 0;
  EXPECT_THROW(fit_landmarks(model, all, options), InvalidInput);
}

TEST(FitLandmarks, TheIterationLimitIsReported) {
  const MorphableModel model = toy_model();
  FitOptions options;
  options.iterations = 1;
  const FitResult fit =
      fit_landmarks(model, project_landmarks(model, person(model, 11).mesh.V, camera_at(20).affine()), options);
  EXPECT_EQ(fit.summary.stop, FitStop::iteration_limit);
  EXPECT_EQ(fit.summary.iterations, 1);
  EXPECT_EQ(to_string(fit.summary.stop), "iteration limit");
}

}  // namespace
}  // namespace facewright
