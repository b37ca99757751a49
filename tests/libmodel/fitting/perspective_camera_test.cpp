// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/perspective_camera.h"

#include <gtest/gtest.h>

#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/fitting/fit_perspective.h"
#include "tests/libmodel/fitting/toy_model.h"
#include "tests/support/matchers.h"

namespace facewright {
namespace {

PerspectiveCamera planted(double yaw, double focal = 1500, double distance = 500) {
  PerspectiveCamera camera;
  camera.R = rotation({yaw, 0.12, -0.07});
  camera.t = {40, -25, -distance};
  camera.focal_px = focal;
  camera.principal = {640, 511.5};
  return camera;
}

Vertices landmark_points(const MorphableModel& model, const Vertices& V) {
  Vertices X(static_cast<Eigen::Index>(model.landmarks().size()), 3);
  Eigen::Index k = 0;
  for (const auto& [name, mark] : model.landmarks()) X.row(k++) = V.row(mark.vertex);
  return X;
}

Pixels project(const PerspectiveCamera& camera, const Vertices& X) {
  Pixels x(X.rows(), 2);
  for (Eigen::Index k = 0; k < X.rows(); ++k) x.row(k) = camera.project(X.row(k).transpose()).transpose();
  return x;
}

ImageLandmarks landmarks(const MorphableModel& model, const Vertices& V, const PerspectiveCamera& camera) {
  ImageLandmarks out;
  for (const auto& [name, mark] : model.landmarks())
    out[name].position = camera.project(V.row(mark.vertex).transpose());
  return out;
}

PerspectiveOptions known(const PerspectiveCamera& camera) {
  PerspectiveOptions options;
  options.focal_px = camera.focal_px;
  options.principal = camera.principal;
  return options;
}
PerspectiveOptions unknown(const PerspectiveCamera& camera, double prior, double spread = 1e6) {
  PerspectiveOptions options;
  options.principal = camera.principal;
  options.prior_focal_px = prior;
  options.prior_focal_spread = spread;
  return options;
}

void expect_same(const PerspectiveCamera& a, const PerspectiveCamera& b, double tolerance) {
  EXPECT_THAT(a.R, MatrixNear(b.R, tolerance));
  EXPECT_LT((a.t - b.t).norm(), tolerance * b.t.norm());
  EXPECT_NEAR(a.focal_px, b.focal_px, tolerance * b.focal_px);
}

TEST(PerspectiveCamera, AgreesWithItsAffineNeighbourToFirstOrder) {
  const PerspectiveCamera camera = planted(0.4);
  const Eigen::Vector3d x(20, -30, 15), step(3e-4, -2e-4, 5e-4);
  const AffineCamera near = camera.affine_at(x);
  EXPECT_LT((near.project(x) - camera.project(x)).norm(), 1e-10);
  EXPECT_LT((near.project(x + step) - camera.project(x + step)).norm(), 1e-7);  // second order: f / d^2 step^2
}

TEST(PerspectiveCamera, FromFarAwayItIsTheOrthographicOneItCameFrom) {
  const OrthographicCamera near{3.2, rotation({0.5, 0.1, 0.05}), {410, 390}};
  const Vertices X = toy_model().mean().V;
  const PerspectiveCamera camera = perspective_from_orthographic(near, 1e8, {400, 400}, X.colwise().mean().transpose());
  for (const int i : {0, 100, 500}) {
    const Eigen::Vector3d x = X.row(i).transpose();
    EXPECT_LT((camera.project(x) - near.affine().project(x)).norm(), 1e-2);
  }
}

TEST(PerspectiveCamera, DerivativeMatchesDifferences) {
  const PerspectiveCamera camera = planted(0.3);
  const Vertices X = landmark_points(toy_model(), toy_model().mean().V);
  const Eigen::Vector3d centre = X.colwise().mean().transpose(), c = camera.in_camera(centre);
  const Eigen::MatrixXd J = pixel_derivative(camera, X, centre, true);
  const double h = 1e-6;
  for (int p = 0; p < 7; ++p) {
    const auto moved = [&](double by) {
      PerspectiveCamera m = camera;
      Eigen::Vector3d there = c;
      if (p < 3) m.R = Eigen::AngleAxisd(by, Eigen::Vector3d::Unit(p)) * camera.R;
      if (p == 3) there[0] += by * -c[2] / camera.focal_px;
      if (p == 4) there[1] -= by * -c[2] / camera.focal_px;
      if (p == 5) there *= std::exp(-by);
      if (p == 6) there *= std::exp(by), m.focal_px *= std::exp(by);
      m.t = there - m.R * centre;
      const Pixels x = project(m, X);
      return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(x.data(), x.size()));
    };
    EXPECT_LT(((moved(h) - moved(-h)) / (2 * h) - J.col(p)).cwiseAbs().maxCoeff(), 1e-5) << p;
  }
}

TEST(EstimatePerspectiveCamera, RecoversPlantedCameraOfKnownFocalLength) {
  const Vertices X = landmark_points(toy_model(), toy_model().mean().V);
  for (const double yaw : {-0.9, -0.3, 0.0, 0.5, 1.0})
    for (const double distance : {250.0, 500.0, 3000.0}) {
      const PerspectiveCamera truth = planted(yaw, 3 * distance, distance);
      const PerspectiveResult found = estimate_perspective_camera(X, project(truth, X), known(truth));
      EXPECT_TRUE(found.summary.converged);
      expect_same(found.camera, truth, 1e-9);
      EXPECT_LT(found.summary.rms_px, 1e-9);
    }
}

TEST(EstimatePerspectiveCamera, RecoversPlantedCameraOfUnknownFocalLength) {
  const Vertices X = landmark_points(toy_model(), toy_model().mean().V);
  for (const double yaw : {-0.6, 0.0, 0.4})
    for (const double prior : {800.0, 1500.0, 3000.0}) {
      const PerspectiveCamera truth = planted(yaw);
      const PerspectiveResult found = estimate_perspective_camera(X, project(truth, X), unknown(truth, prior));
      expect_same(found.camera, truth, 1e-7);  // the prior still pulls, by its spread of a million
      EXPECT_TRUE(found.summary.focal_determined);
    }
}

TEST(EstimatePerspectiveCamera, SaysWhenTheLandmarksCannotTellTheFocalLength) {
  const Vertices X = landmark_points(toy_model(), toy_model().mean().V);
  const PerspectiveCamera near = planted(0.2, 900, 300), far = planted(0.2, 90000, 30000);
  const PerspectiveResult close = estimate_perspective_camera(X, project(near, X), unknown(near, 1500, 0.5));
  EXPECT_TRUE(close.summary.focal_determined);
  EXPECT_NEAR(close.camera.focal_px, 900, 9);
  const PerspectiveResult distant = estimate_perspective_camera(X, project(far, X), unknown(far, 60000, 0.5));
  EXPECT_FALSE(distant.summary.focal_determined);
  EXPECT_LT(distant.summary.rms_px, 1);
}

TEST(EstimatePerspectiveCamera, FollowsTheImagesScale) {
  const Vertices X = landmark_points(toy_model(), toy_model().mean().V);
  const PerspectiveCamera truth = planted(0.4);
  Random random(3);
  Pixels x = project(truth, X);
  for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] += random.normal();
  const PerspectiveResult one = estimate_perspective_camera(X, x, known(truth));
  PerspectiveOptions four = known(truth);
  four.focal_px *= 4, four.principal *= 4;
  const PerspectiveResult other = estimate_perspective_camera(X, x * 4, four);
  EXPECT_THAT(other.camera.R, MatrixNear(one.camera.R, 1e-9));
  EXPECT_LT((other.camera.t - one.camera.t).norm(), 1e-6);
  EXPECT_NEAR(other.summary.rms_px, 4 * one.summary.rms_px, 1e-6);
}

TEST(EstimatePerspectiveCamera, RefusesWhatCannotBeUsed) {
  const Vertices X = landmark_points(toy_model(), toy_model().mean().V);
  const PerspectiveCamera truth = planted(0.2);
  const Pixels x = project(truth, X);
  EXPECT_THROW(estimate_perspective_camera(X.topRows(3), x.topRows(3), known(truth)), InvalidInput);
  Vertices flat = X;
  flat.col(2).setZero();
  EXPECT_THROW(estimate_perspective_camera(flat, project(truth, flat), known(truth)), InvalidInput);
  EXPECT_THROW(estimate_perspective_camera(X, x, {}), InvalidInput);  // neither focal length nor prior
  PerspectiveOptions bad = known(truth);
  bad.focal_px = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(estimate_perspective_camera(X, x, bad), InvalidInput);
  const std::vector<Information> none(static_cast<size_t>(X.rows()), Information::Zero());
  EXPECT_THROW(refine_perspective(truth, X, x, none, known(truth)), SolverError);
  EXPECT_THROW(refine_perspective(truth, X, x.topRows(5), none, known(truth)), InvalidInput);
}

PerspectiveFitOptions exact(const PerspectiveOptions& camera) {
  PerspectiveFitOptions options;
  options.camera = camera;
  options.fit.lambda = 1e-12;
  options.fit.jaw = JawMode::fixed;
  options.fit.iterations = 500;
  options.fit.tolerance = 1e-11;
  return options;
}

TEST(FitLandmarksPerspective, PlantedFacesComeBackExactly) {
  const MorphableModel model = toy_model(5);
  for (const double yaw : {-0.5, 0.0, 0.7}) {
    Random random(7);
    const Eigen::VectorXd c = model.shape().draw_coefficients(random);
    const PerspectiveCamera truth = planted(yaw);
    const PerspectiveFitResult fit =
        fit_landmarks_perspective(model, landmarks(model, model.instance(c).V, truth), exact(known(truth)));
    EXPECT_THAT(fit.shape_coefficients, MatrixNear(c, 1e-6));
    expect_same(fit.camera, truth, 1e-7);
    EXPECT_EQ(fit.summary.stop, FitStop::converged);
  }
}

TEST(FitLandmarksPerspective, TakesShapeFromPerspectiveThatTheOrthographicFitCannotTellApart) {
  const MorphableModel model = toy_model();
  const PerspectiveCamera truth = planted(0.3, 900, 300);  // a close-up
  double near = 0, far = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    Random random(seed);
    const Eigen::VectorXd c = model.shape().draw_coefficients(random);
    const ImageLandmarks seen = landmarks(model, model.instance(c).V, truth);
    PerspectiveFitOptions options;
    options.camera = known(truth);
    options.fit.jaw = JawMode::fixed;
    near += (fit_landmarks_perspective(model, seen, options).shape_coefficients - c).norm();
    far += (fit_landmarks(model, seen, options.fit).shape_coefficients - c).norm();
  }
  EXPECT_LT(near, 0.8 * far);
}

TEST(FitLandmarksPerspective, TellsWhatItDoesNotKnow) {
  const MorphableModel model = toy_model();
  const PerspectiveCamera truth = planted(0.3);
  PerspectiveFitOptions options;
  options.camera = unknown(truth, 1200, 0.5);
  const PerspectiveFitResult fit = fit_landmarks_perspective(model, landmarks(model, model.mean().V, truth), options);
  EXPECT_GT(fit.summary.focal_spread, 0);
  EXPECT_LE(fit.summary.focal_spread, 0.5 + 1e-9);
  EXPECT_GT(fit.coefficient_spread.minCoeff(), 0);
  EXPECT_LE(fit.coefficient_spread.maxCoeff(), 1 + 1e-9);  // landmarks never take away from the prior
}

TEST(FitLandmarksPerspective, FitsExpressionsAsAsked) {
  MorphableModelParts parts = toy_model(5).parts();
  parts.expression = PcaModel{Eigen::VectorXd::Zero(parts.shape.mean.size()), parts.shape.basis.rightCols<2>(),
                              parts.shape.variances.tail<2>()};
  parts.shape = parts.shape.truncated(3);
  const MorphableModel model(parts);
  PerspectiveFitOptions options = exact(known(planted(0.2)));
  const ImageLandmarks seen = landmarks(model, model.mean().V, planted(0.2));
  EXPECT_EQ(fit_landmarks_perspective(model, seen, options).expression_coefficients.size(), 2);
  options.fit.expression.mode = ExpressionMode::none;
  EXPECT_EQ(fit_landmarks_perspective(model, seen, options).expression_coefficients.size(), 0);
  options.fit.expression.mode = ExpressionMode::blendshapes;
  EXPECT_THROW(fit_landmarks_perspective(model, seen, options), InvalidInput);
}

TEST(FitLandmarksPerspective, BlendshapesComeBackWithinTheirBounds) {
  MorphableModelParts parts = toy_model(5).parts();
  Vertices open = Vertices::Zero(parts.levels.back().vertex_count, 3), wide = open;
  const Vertices mean = as_vertices(parts.shape.mean);
  for (Eigen::Index i = 0; i < mean.rows(); ++i) {
    open(i, 1) = mean(i, 1) < -48 ? -12 : 0;
    wide(i, 0) = mean(i, 1) < -30 ? 0.15 * mean(i, 0) : 0;
  }
  parts.blendshapes = {{"open", as_vector(open)}, {"wide", as_vector(wide)}};
  const MorphableModel model(parts);
  const PerspectiveCamera truth = planted(0.3);
  PerspectiveFitOptions options;
  options.camera = known(truth);
  options.fit.jaw = JawMode::fixed;
  options.fit.sigma_mm = 0.05;
  const auto weights = [&](double a, double b) {
    return fit_landmarks_perspective(model, landmarks(model, model.mean().V + a * open + b * wide, truth), options)
        .blendshape_weights;
  };
  EXPECT_NEAR(weights(0.7, 0).at("open"), 0.7, 0.02);  // the priors hold back a little
  EXPECT_NEAR(weights(0.2, 0.6).at("wide"), 0.6, 0.02);
  for (const auto& [name, weight] : weights(1.3, -0.4)) {
    EXPECT_GE(weight, 0) << name;
    EXPECT_LE(weight, 1) << name;
  }
}

TEST(FitLandmarksPerspective, TheMeshOfAFitHasItsExpressionAndMeetsTheLandmarks) {
  const MorphableModel model = toy_model();
  const PerspectiveCamera truth = planted(0.2);
  const ImageLandmarks seen = landmarks(model, model.mean().V, truth);
  PerspectiveFitOptions options;
  options.camera = known(truth);
  const PerspectiveFitResult fit = fit_landmarks_perspective(model, seen, options);
  const Mesh mesh = fitted_mesh(model, fit);
  for (const LandmarkResidual& r : fit.summary.residuals)
    EXPECT_LT((fit.camera.project(mesh.V.row(r.vertex).transpose()) - r.fitted).norm(), 1e-6) << r.name;
  const double eyes = (seen.at("37").position - seen.at("46").position).norm();
  EXPECT_NEAR(fit.summary.outer_eye_distance_px, eyes, 1e-9);
  EXPECT_NEAR(fit.summary.rms_percent, 100 * fit.summary.rms_px / eyes, 1e-9);
}

TEST(FitLandmarksPerspective, RefusesTooFewLandmarks) {
  const MorphableModel model = toy_model();
  PerspectiveFitOptions options;
  options.camera = known(planted(0));
  ImageLandmarks few;
  few["31"].position = {1, 2};
  few["nobody"].position = {3, 4};
  EXPECT_THROW(fit_landmarks_perspective(model, few, options), InvalidInput);
}

}  // namespace
}  // namespace facewright
