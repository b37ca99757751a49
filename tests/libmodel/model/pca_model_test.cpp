// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/pca_model.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "model_fixtures.h"

namespace facewright {
namespace {

constexpr double kRounding = 1e-10;  // all algebra below is exact up to rounding

TEST(PcaModel, CoefficientsInvertInstance) {
  Random random(1);
  const PcaModel model = testing::random_pca(random, 300, 12, 20);
  const Eigen::VectorXd c = model.draw_coefficients(random);
  EXPECT_LT((model.coefficients(model.instance(c)) - c).cwiseAbs().maxCoeff(), kRounding);
}

TEST(PcaModel, CoefficientsInvertInstanceOnLeadingRows) {
  Random random(2);
  const PcaModel model = testing::random_pca(random, 300, 12, 20), part = model.leading_rows(40);
  const Eigen::VectorXd c = model.draw_coefficients(random);
  EXPECT_FALSE(part.orthonormal);
  EXPECT_LT((part.coefficients(part.instance(c)) - c).cwiseAbs().maxCoeff(), kRounding);
  EXPECT_LT((model.coefficients(model.instance(c, 40)) - c).cwiseAbs().maxCoeff(), kRounding);
}

TEST(PcaModel, LeadingRowsAreBitIdentical) {
  Random random(3);
  const PcaModel model = testing::random_pca(random, 333, 30, 20);
  const Eigen::VectorXd c = model.draw_coefficients(random), x = model.instance(c);
  for (Eigen::Index n : {1, 7, 50, 110}) {
    EXPECT_EQ(model.instance(c, n), x.head(3 * n));
    EXPECT_EQ(model.leading_rows(n).instance(c), x.head(3 * n));
  }
}

TEST(PcaModel, ProjectionIsIdempotentAndLeavesAnOrthogonalResidual) {
  Random random(4);
  const PcaModel model = testing::random_pca(random, 90, 6, 5);
  const Eigen::VectorXd x = testing::random_matrix(random, 90, 1) * 30, p = model.project(x);
  EXPECT_LT((model.project(p) - p).norm(), kRounding);
  EXPECT_LT((model.basis.transpose() * (x - p)).norm(), kRounding * x.norm());
}

TEST(PcaModel, OrthonormalisedIsTheSameGaussian) {
  Random random(5);
  const PcaModel part = testing::random_pca(random, 300, 8, 20).leading_rows(30), whole = part.orthonormalised();
  const Eigen::MatrixXd W = part.rescaled_basis(), U = whole.rescaled_basis();
  EXPECT_LT((W * W.transpose() - U * U.transpose()).norm(), kRounding * (W * W.transpose()).norm());
  EXPECT_LT((whole.basis.transpose() * whole.basis - Eigen::MatrixXd::Identity(8, 8)).norm(), kRounding);
  EXPECT_TRUE(whole.orthonormal);
  EXPECT_NO_THROW(validate(whole));
}

TEST(OrthonormalLevel, CoefficientsOfALevelAndSharedOnesGiveTheSameFaceBothWays) {
  Random random(15);
  const PcaModel model = testing::random_pca(random, 900, 40, 20);  // sqrt(0.6^39): a condition number of 2e4
  for (const Eigen::Index vertices : {60, 100, 299}) {
    const PcaModel part = model.leading_rows(vertices);
    const OrthonormalLevel level = orthonormal_level(part);
    const Eigen::VectorXd c = testing::random_matrix(random, 40, 1), d = testing::random_matrix(random, 40, 1);
    EXPECT_LT((level.own_from_shared * level.own_from_shared.transpose() - Eigen::MatrixXd::Identity(40, 40)).norm(),
              1e-12);
    EXPECT_LT((level.model.basis.transpose() * level.model.basis - Eigen::MatrixXd::Identity(40, 40)).norm(), 1e-12);
    EXPECT_LT((level.model.instance(level.own(c)) - part.instance(c)).norm(), 1e-10);
    EXPECT_LT((part.instance(level.shared(d)) - level.model.instance(d)).norm(), 1e-10);
    EXPECT_LT((level.shared(level.own(c)) - c).norm(), 1e-12);
    EXPECT_LT((level.model.coefficients(part.instance(c)) - level.own(c)).norm(), 1e-10);
    EXPECT_LT((level.own(c.head(7)) - level.own_from_shared.leftCols(7) * c.head(7)).norm(), 1e-12);
    EXPECT_NO_THROW(validate(level.model));
  }
}

TEST(OrthonormalLevel, ModesThatVanishAtALevelLeaveTheLikeliestCoefficients) {
  Random random(16);
  const PcaModel part = testing::random_pca(random, 90, 20, 3).leading_rows(4);  // 12 values, 20 modes
  const OrthonormalLevel level = orthonormal_level(part);
  ASSERT_EQ(level.model.mode_count(), 12);
  const Eigen::VectorXd c = testing::random_matrix(random, 20, 1), likeliest = level.shared(level.own(c));
  EXPECT_LT((part.instance(likeliest) - part.instance(c)).norm(), 1e-10);
  EXPECT_LT(likeliest.norm(), c.norm());
  EXPECT_LT((level.own(likeliest) - level.own(c)).norm(), 1e-12);
  PcaModel still = part;
  still.variances.setZero();
  EXPECT_EQ(orthonormal_level(still).model.mode_count(), 0);
}

TEST(OrthonormalLevel, AnOrthonormalModelIsItself) {
  Random random(17);
  const PcaModel model = testing::random_pca(random, 90, 6, 3);
  const OrthonormalLevel level = orthonormal_level(model);
  EXPECT_EQ(level.model.basis, model.basis);
  EXPECT_EQ(level.own_from_shared, Eigen::MatrixXd::Identity(6, 6));
  EXPECT_THROW(level.own(Eigen::VectorXd::Zero(7)), InvalidInput);
  EXPECT_THROW(level.shared(Eigen::VectorXd::Zero(7)), InvalidInput);
}

TEST(PcaModel, SampledVarianceIsTheModelsVariance) {
  Random random(6);
  const PcaModel model = testing::random_pca(random, 30, 3, 2);
  double sum = 0;
  const int n = 20000;
  for (int i = 0; i < n; ++i) sum += (model.instance(model.draw_coefficients(random)) - model.mean).squaredNorm();
  EXPECT_NEAR(sum / n / model.variances.sum(), 1, 0.03);  // standard error of the mean ratio is below 0.01
}

TEST(PcaModel, AModeWithoutVarianceHasCoefficientZero) {
  Random random(7);
  PcaModel model = testing::random_pca(random, 30, 3, 2);
  model.variances[2] = 0;
  const Eigen::VectorXd c = model.coefficients(model.mean + model.basis.col(2));
  EXPECT_TRUE(c.allFinite());
  EXPECT_EQ(c[2], 0);
}

TEST(PcaModel, RefusesTooManyCoefficientsAndInconsistentParts) {
  Random random(8);
  PcaModel model = testing::random_pca(random, 30, 3, 2);
  EXPECT_THROW(model.instance(Eigen::VectorXd::Zero(4)), InvalidInput);
  EXPECT_THROW(model.coefficients(Eigen::VectorXd::Zero(33)), InvalidInput);
  EXPECT_THROW(model.leading_rows(11), InvalidInput);
  PcaModel unordered = model;
  unordered.variances.reverseInPlace();
  EXPECT_THROW(validate(unordered), InvalidInput);
  PcaModel undefined = model;
  undefined.basis(3, 1) = std::nan("");
  EXPECT_THROW(validate(undefined), InvalidInput);
}

}  // namespace
}  // namespace facewright
