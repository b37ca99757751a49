// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/affine_camera.h"

#include <gtest/gtest.h>

#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/fitting/orthographic_camera.h"
#include "libmodel/render/head_pose.h"

namespace facewright {
namespace {

Vertices points(Random& random, int n) {
  return Vertices::NullaryExpr(n, 3, [&] { return 60 * random.normal(); });
}

Pixels project(const AffineCamera& camera, const Vertices& X) {
  return (X * camera.A.transpose()).rowwise() + camera.b.transpose();
}

AffineCamera random_affine(Random& random) {
  AffineCamera camera;
  camera.A = Eigen::Matrix<double, 2, 3>::NullaryExpr([&] { return 3 * random.normal(); });
  camera.b = Eigen::Vector2d(random.uniform(0, 4000), random.uniform(0, 4000));
  return camera;
}

OrthographicCamera random_orthographic(Random& random) {
  OrthographicCamera camera;
  camera.s = random.uniform(0.5, 8);
  camera.R = rotation({random.uniform(-1, 1), random.uniform(-0.6, 0.6), random.uniform(-1, 1)});
  camera.t = {random.uniform(0, 2000), random.uniform(0, 2000)};
  return camera;
}

TEST(EstimateAffineCamera, RecoversANoiseFreeCameraToRounding) {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const AffineCamera truth = random_affine(random);
    const Vertices X = points(random, 4 + trial % 30);
    const AffineCameraResult found = estimate_affine_camera(X, project(truth, X));
    EXPECT_LT((found.camera.A - truth.A).norm(), 1e-9 * found.summary.condition);
    EXPECT_LT((found.camera.b - truth.b).norm(), 1e-9 * found.summary.condition);
    EXPECT_LT(found.summary.rms_px, 1e-9);
  }
}

TEST(EstimateAffineCamera, NoOtherCameraHasLessError) {
  Random random(2);
  const Vertices X = points(random, 30);
  Pixels x = project(random_affine(random), X);
  for (Eigen::Index k = 0; k < x.size(); ++k) x.data()[k] += random.normal();
  const AffineCameraResult best = estimate_affine_camera(X, x);
  for (int trial = 0; trial < 200; ++trial) {
    AffineCamera other = best.camera;
    other.A += 1e-3 * Eigen::Matrix<double, 2, 3>::NullaryExpr([&] { return random.normal(); });
    other.b += 1e-2 * Eigen::Vector2d(random.normal(), random.normal());
    EXPECT_GE(std::sqrt((project(other, X) - x).rowwise().squaredNorm().mean()), best.summary.rms_px);
  }
}

TEST(EstimateAffineCamera, FollowsShiftsAndScalesOfTheImage) {
  Random random(3);
  const Vertices X = points(random, 20);
  Pixels x = project(random_affine(random), X);
  for (Eigen::Index k = 0; k < x.size(); ++k) x.data()[k] += random.normal();
  const AffineCamera camera = estimate_affine_camera(X, x).camera;
  const AffineCamera moved = estimate_affine_camera(X, (2.5 * x).rowwise() + Eigen::RowVector2d(100, -30)).camera;
  EXPECT_LT((moved.A - 2.5 * camera.A).norm(), 1e-9);
  EXPECT_LT((moved.b - 2.5 * camera.b - Eigen::Vector2d(100, -30)).norm(), 1e-9);
}

TEST(EstimateAffineCamera, DegenerateInputIsRefused) {
  Random random(4);
  const AffineCamera camera = random_affine(random);
  Vertices X = points(random, 3);
  EXPECT_THROW(estimate_affine_camera(X, project(camera, X)), InvalidInput);
  X = points(random, 12);
  EXPECT_THROW(estimate_affine_camera(X, Pixels(11, 2)), InvalidInput);
  X.col(2) = X.col(0) - 2 * X.col(1);  // in a plane
  EXPECT_THROW(estimate_affine_camera(X, project(camera, X)), InvalidInput);
  X.setOnes();
  EXPECT_THROW(estimate_affine_camera(X, project(camera, X)), InvalidInput);
  X = points(random, 12);
  X(3, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(estimate_affine_camera(X, Pixels::Zero(12, 2)), InvalidInput);
}

TEST(NearestOrthographic, IsExactForAnOrthographicCamera) {
  Random random(5);
  for (int trial = 0; trial < 50; ++trial) {
    const OrthographicCamera truth = random_orthographic(random), found = nearest_orthographic(truth.affine());
    EXPECT_NEAR(found.s, truth.s, 1e-12);
    EXPECT_LT((found.R - truth.R).norm(), 1e-12);
    EXPECT_NEAR(found.R.determinant(), 1, 1e-12);
  }
}

TEST(RefineOrthographic, RecoversANoiseFreeCameraFromAPerturbedStart) {
  Random random(6);
  for (int trial = 0; trial < 50; ++trial) {
    const OrthographicCamera truth = random_orthographic(random);
    const Vertices X = points(random, 10);
    OrthographicCamera start = truth;
    start.R = rotation({0.2, -0.1, 0.1}) * truth.R;
    start.s *= 1.2;
    start.t += Eigen::Vector2d(30, -20);
    const std::vector<Information> W(10, Information::Identity());
    const OrthographicResult found = refine_orthographic(start, X, project(truth.affine(), X), W);
    EXPECT_TRUE(found.summary.converged);
    EXPECT_LT((found.camera.R - truth.R).norm(), 1e-9);
    EXPECT_NEAR(found.camera.s / truth.s, 1, 1e-9);
    EXPECT_LT((found.camera.t - truth.t).norm(), 1e-7);
  }
}

TEST(RefineOrthographic, PointsWithoutWeightDoNotCountAndTooFewAreRefused) {
  Random random(7);
  const OrthographicCamera truth = random_orthographic(random);
  const Vertices X = points(random, 10);
  Pixels x = project(truth.affine(), X);
  x.row(4) += Eigen::RowVector2d(500, 500);
  std::vector<Information> W(10, Information::Identity());
  W[4].setZero();
  EXPECT_LT((refine_orthographic(truth, X, x, W).camera.R - truth.R).norm(), 1e-9);
  EXPECT_THROW(refine_orthographic(truth, X, x, std::vector<Information>(10, Information::Zero())), SolverError);
}

}  // namespace
}  // namespace facewright
