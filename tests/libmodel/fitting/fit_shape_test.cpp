// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/fit_shape.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "libmodel/render/head_pose.h"
#include "tests/libmodel/fitting/toy_model.h"

namespace facewright {
namespace {

struct Planted {
  MorphableModel model;
  Eigen::VectorXd truth;
  AffineCamera camera;
  std::vector<Observation> seen;
  LandmarkShapeModel local;
};

Planted planted(int modes) {
  Planted p{toy_model(modes), {}, {}, {}, {}};
  Random random(9);
  p.truth = p.model.shape().draw_coefficients(random);
  p.camera = OrthographicCamera{2.5, rotation({0.3, 0.1, -0.1}), {400, 300}}.affine();
  p.seen = observations(project_landmarks(p.model, p.model.instance(p.truth).V, p.camera), p.model, {});
  p.local = landmark_shape_model(p.seen, p.model.shape(), -1);
  return p;
}

std::vector<Information> weights(const Planted& p, double sigma) {
  return std::vector<Information>(p.seen.size(), Information::Identity() / (sigma * sigma));
}

TEST(FitShape, IsExactWithoutNoiseAndPriorWhenModesAreFew) {
  const Planted p = planted(8);
  const Eigen::VectorXd c = fit_shape(p.local, p.seen, p.camera, weights(p, 1), 0);
  EXPECT_LT((c - p.truth).norm(), 1e-9);
}

TEST(FitShape, PriorAndNoiseTradeOffAsOneProduct) {
  const Planted p = planted(8);  // multiplying sigma^2 and dividing lambda by the same number changes nothing
  const Eigen::VectorXd a = fit_shape(p.local, p.seen, p.camera, weights(p, 1), 2);
  const Eigen::VectorXd b = fit_shape(p.local, p.seen, p.camera, weights(p, 2), 0.5);
  EXPECT_LT((a - b).norm(), 1e-9);
}

TEST(FitShape, CoefficientsShrinkAsThePriorGrows) {
  const Planted p = planted(8);
  double last = 1e9;
  for (const double lambda : {0.0, 0.1, 1.0, 10.0, 1e3, 1e9}) {
    const double norm = fit_shape(p.local, p.seen, p.camera, weights(p, 1), lambda).norm();
    EXPECT_LT(norm, last);
    last = norm;
  }
  EXPECT_LT(last, 1e-3);
}

TEST(FitShape, SolutionIsAMinimumOfThePosterior) {
  const Planted p = planted(8);
  const auto W = weights(p, 3);
  const auto cost = [&](const Eigen::VectorXd& c) {
    const Vertices X = p.local.points(c);
    double sum = c.squaredNorm();
    for (size_t k = 0; k < p.seen.size(); ++k)
      sum += (p.seen[k].pixel - p.camera.project(X.row(static_cast<Eigen::Index>(k)).transpose())).squaredNorm() / 9;
    return sum;
  };
  const Eigen::VectorXd c = fit_shape(p.local, p.seen, p.camera, W, 1);
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::VectorXd step = Eigen::VectorXd::NullaryExpr(8, [&] { return 0.05 * random.normal(); });
    EXPECT_GT(cost(c + step), cost(c));
  }
}

TEST(FitShape, UnderdeterminedLeastSquaresStaysFinite) {
  const Planted p = planted(150);  // more modes than equations
  const Eigen::VectorXd c = fit_shape(p.local, p.seen, p.camera, weights(p, 1), 0);
  EXPECT_TRUE(c.allFinite());
  EXPECT_LE(c.norm(), p.truth.norm() + 1e-6);  // the solution of least norm
}

TEST(FitShape, AModelWithoutModesHasNoCoefficients) {
  const Planted p = planted(4);
  const LandmarkShapeModel mean = landmark_shape_model(p.seen, p.model.shape().truncated(0), -1);
  for (const double lambda : {0.0, 1.0})
    EXPECT_EQ(fit_shape(mean, p.seen, p.camera, weights(p, 1), lambda).size(), 0) << lambda;
}

TEST(FitShape, RefusesANegativePrior) {
  const Planted p = planted(4);
  EXPECT_THROW(fit_shape(p.local, p.seen, p.camera, weights(p, 1), -1), InvalidInput);
}

}  // namespace
}  // namespace facewright
