// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/pca.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "libmodel/core/errors.h"
#include "planted.h"

namespace facewright {
namespace {

using testing::planted_gaussian;

// Largest sine of the angles between the subspaces of two orthonormal bases.
double subspace_distance(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) {
  return (A - B * (B.transpose() * A)).norm();
}

TEST(FitPca, RecoversAPlantedSubspace) {
  Random random(1);
  const auto planted = planted_gaussian(random, 60, 900, 20);
  PcaOptions options;
  options.variance_share = 1;
  const PcaResult fit = fit_pca(planted.samples, options);
  EXPECT_EQ(fit.summary.rank, 20);
  EXPECT_EQ(fit.model.mode_count(), 20);
  EXPECT_LT(subspace_distance(planted.basis, fit.model.basis), 1e-6);
}

TEST(FitPca, AgreesWithTheEigenvectorsOfTheCovariance) {
  Random random(2);
  const auto planted = planted_gaussian(random, 15, 120, 40);
  PcaOptions options;
  options.variance_share = 1;
  const PcaResult fit = fit_pca(planted.samples, options);
  const Eigen::MatrixXd C = planted.samples.rowwise() - planted.samples.colwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> covariance(C.transpose() * C / 14);
  ASSERT_EQ(fit.model.mode_count(), 14);
  for (int k = 0; k < 14; ++k) {
    EXPECT_NEAR(fit.model.variances[k], covariance.eigenvalues()[119 - k], 1e-9 * fit.model.variances[0]);
    EXPECT_NEAR(std::abs(fit.model.basis.col(k).dot(covariance.eigenvectors().col(119 - k))), 1, 1e-9);
  }
}

TEST(FitPca, LanczosAgreesWithTheDenseSolver) {
  Random random(3);
  const auto planted = planted_gaussian(random, 400, 300, 25);
  PcaOptions dense, lanczos;
  lanczos.dense_limit = 10;
  const PcaResult a = fit_pca(planted.samples, dense), b = fit_pca(planted.samples, lanczos);
  ASSERT_EQ(a.model.mode_count(), b.model.mode_count());
  EXPECT_LT((a.model.variances - b.model.variances).norm(), 1e-8 * a.model.variances[0]);
  EXPECT_LT(subspace_distance(a.model.basis, b.model.basis), 1e-7);
}

TEST(FitPca, VariancesSumToTheTotalVariance) {
  Random random(4);
  const auto planted = planted_gaussian(random, 30, 150, 60);
  PcaOptions options;
  options.variance_share = 1;
  const PcaResult fit = fit_pca(planted.samples, options);
  const double total = (planted.samples.rowwise() - planted.samples.colwise().mean()).squaredNorm() / 29;
  EXPECT_NEAR(fit.summary.total_variance / total, 1, 1e-12);
  EXPECT_NEAR(fit.model.variances.sum() / total, 1, 1e-10);
}

TEST(FitPca, KeepsTheFewestModesThatReachTheShare) {
  Random random(5);
  const auto planted = planted_gaussian(random, 50, 200, 30);
  const PcaResult fit = fit_pca(planted.samples);
  const Eigen::VectorXd& variances = fit.model.variances;
  EXPECT_GE(variances.sum(), 0.99 * fit.summary.total_variance);
  EXPECT_LT(variances.head(variances.size() - 1).sum(), 0.99 * fit.summary.total_variance);
}

TEST(FitPca, BasisIsOrthonormalAndScoresReproduceTheSamples) {
  Random random(6);
  const auto planted = planted_gaussian(random, 40, 300, 39);
  PcaOptions options;
  options.variance_share = 1;
  const PcaResult fit = fit_pca(planted.samples, options);
  const Eigen::Index k = fit.model.mode_count();
  EXPECT_LT((fit.model.basis.transpose() * fit.model.basis - Eigen::MatrixXd::Identity(k, k)).norm(), 1e-12);
  for (int i = 0; i < 40; ++i)
    EXPECT_LT((fit.model.instance(fit.scores.row(i)) - planted.samples.row(i).transpose()).norm(), 1e-6);
}

TEST(FitPca, SignsDoNotDependOnTheOrderOfSamples) {
  Random random(7);
  auto planted = planted_gaussian(random, 20, 60, 5);
  const PcaResult a = fit_pca(planted.samples);
  planted.samples = planted.samples.colwise().reverse().eval();
  const PcaResult b = fit_pca(planted.samples);
  EXPECT_LT((a.model.basis - b.model.basis).norm(), 1e-9);
  for (Eigen::Index k = 0; k < a.model.mode_count(); ++k) {
    Eigen::Index largest = 0;
    a.model.basis.col(k).cwiseAbs().maxCoeff(&largest);
    EXPECT_GT(a.model.basis(largest, k), 0);
  }
}

TEST(FitPca, FewOrEqualSamplesGiveFewModesAndNoNaN) {
  Random random(8);
  const auto planted = planted_gaussian(random, 3, 90, 3);
  PcaOptions options;
  options.variance_share = 1;
  for (Eigen::Index n : {1, 2, 3}) {
    const PcaResult fit = fit_pca(planted.samples.topRows(n), options);
    EXPECT_EQ(fit.model.mode_count(), n - 1);
    EXPECT_NO_THROW(validate(fit.model));
  }
  const SampleMatrix same = planted.samples.row(0).replicate(7, 1);
  const PcaResult none = fit_pca(same, options);
  EXPECT_EQ(none.model.mode_count(), 0);
  EXPECT_NO_THROW(validate(none.model));
  SampleMatrix twice(6, 90);
  twice << planted.samples, planted.samples;
  EXPECT_EQ(fit_pca(twice, options).model.mode_count(), 2);
}

TEST(FitPca, BytesDoNotDependOnThreads) {
  Random random(9);
  const auto planted = planted_gaussian(random, 150, 9000, 30);
  PcaOptions one, four;
  one.threads = 1;
  four.threads = 4;
  EXPECT_EQ(fit_pca(planted.samples, one).model.basis, fit_pca(planted.samples, four).model.basis);
}

TEST(FitPca, RefusesNaNAndBadOptions) {
  Random random(10);
  auto planted = planted_gaussian(random, 5, 30, 2);
  PcaOptions options;
  options.variance_share = 99;
  EXPECT_THROW(fit_pca(planted.samples, options), InvalidInput);
  planted.samples(3, 4) = std::nan("");
  EXPECT_THROW(fit_pca(planted.samples), InvalidInput);
  EXPECT_THROW(fit_pca(SampleMatrix()), InvalidInput);
}

}  // namespace
}  // namespace facewright
