// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/pca.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

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

// With as many samples as this, Lanczos and random subspaces do not fall back on the whole Gram matrix.
PcaResult fit_with(PcaSolver solver, const SampleMatrix& samples, double share) {
  PcaOptions options;
  options.solver = solver;
  options.variance_share = share;
  return fit_pca(samples, options);
}

TEST(FitPca, AllSolversAgreeWithTheThinSvdOnPlantedLowRank) {
  Random random(3);
  const auto planted = planted_gaussian(random, 420, 240, 25);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(planted.samples.rowwise() - planted.samples.colwise().mean(),
                                              Eigen::ComputeThinU | Eigen::ComputeThinV);
  for (const double share : {0.99, 1.0})
    for (const PcaSolver solver : {PcaSolver::gram, PcaSolver::lanczos, PcaSolver::randomised}) {
      const PcaResult fit = fit_with(solver, planted.samples, share);
      const Eigen::Index k = fit.model.mode_count();
      EXPECT_EQ(fit.summary.solver, solver);
      EXPECT_EQ(fit.summary.rank, 25);
      EXPECT_TRUE(share < 1 || k == 25);
      const Eigen::MatrixXd V = svd.matrixV().leftCols(k);
      EXPECT_LT((fit.model.basis * fit.model.basis.transpose() - V * V.transpose()).norm(), 1e-8);
      const Eigen::VectorXd expected = svd.singularValues().head(k).cwiseAbs2() / 419;
      EXPECT_LT((fit.model.variances - expected).norm(), 1e-10 * expected[0]);
      EXPECT_NEAR(fit.summary.total_variance / svd.singularValues().squaredNorm() * 419, 1, 1e-12);
      EXPECT_LT((fit.model.basis.transpose() * fit.model.basis - Eigen::MatrixXd::Identity(k, k)).norm(), 1e-12);
      EXPECT_LT(fit.summary.residual, 1e-8);
    }
}

TEST(FitPca, SolversAgreeWhenNoiseFillsEveryDirection) {
  Random random(13);
  auto planted = planted_gaussian(random, 450, 300, 20);
  planted.samples += 0.05 * testing::random_matrix(random, 450, 300);
  const PcaResult gram = fit_with(PcaSolver::gram, planted.samples, 0.999);
  for (const PcaSolver solver : {PcaSolver::automatic, PcaSolver::lanczos, PcaSolver::randomised}) {
    const PcaResult fit = fit_with(solver, planted.samples, 0.999);
    ASSERT_EQ(fit.model.mode_count(), gram.model.mode_count());
    EXPECT_LT(subspace_distance(gram.model.basis, fit.model.basis), 1e-8);
  }
}

TEST(FitPca, CoefficientsInvertInstances) {
  Random random(14);
  const auto planted = planted_gaussian(random, 50, 300, 20);
  const PcaModel model = fit_with(PcaSolver::gram, planted.samples, 1).model;
  for (int i = 0; i < 10; ++i) {
    const Eigen::VectorXd c = model.draw_coefficients(random);
    EXPECT_LT((model.coefficients(model.instance(c)) - c).cwiseAbs().maxCoeff(), 1e-10);
  }
}

TEST(FitPca, EverySolverTakesFewOrEqualSamplesAndLimits) {
  Random random(15);
  const auto planted = planted_gaussian(random, 5, 90, 5);
  for (const PcaSolver solver : {PcaSolver::automatic, PcaSolver::gram, PcaSolver::lanczos, PcaSolver::randomised}) {
    for (Eigen::Index n = 1; n <= 5; ++n) {
      const PcaResult fit = fit_with(solver, planted.samples.topRows(n), 1);
      EXPECT_EQ(fit.model.mode_count(), n - 1);
      EXPECT_NO_THROW(validate(fit.model));
      const PcaResult same = fit_with(solver, planted.samples.row(0).replicate(n, 1), 1);
      EXPECT_EQ(same.model.mode_count(), 0);
      EXPECT_NO_THROW(validate(same.model));
    }
    const PcaResult often = fit_with(solver, planted.samples.replicate(100, 1), 1);  // 500 samples of rank 4
    EXPECT_EQ(often.model.mode_count(), 4);
    EXPECT_TRUE(often.model.basis.allFinite() && often.scores.allFinite());
    EXPECT_EQ(fit_with(solver, planted.samples.row(0).replicate(500, 1), 1).model.mode_count(), 0);
    PcaOptions two;
    two.solver = solver;
    two.max_modes = 2;
    EXPECT_EQ(fit_pca(planted.samples.replicate(100, 1), two).model.mode_count(), 2);
    two.max_modes = 0;
    EXPECT_EQ(fit_pca(planted.samples.replicate(100, 1), two).model.mode_count(), 0);
  }
}

TEST(CentredGram, IsTheGramMatrixAboutTheMeanWhateverTheOrigin) {
  Random random(16);
  const auto planted = planted_gaussian(random, 300, 90, 10);
  const Eigen::RowVectorXd origin = planted.mean.array() + 3;
  const Eigen::MatrixXd G = gram_matrix(planted.samples, origin);
  const Eigen::MatrixXd expected = gram_matrix(planted.samples, mean_sample(planted.samples));
  EXPECT_LT((centred_gram(G) - expected).norm(), 1e-10 * expected.norm());
  const std::vector<int> kept = {4, 7, 250, 299};
  const SampleMatrix few = planted.samples(kept, Eigen::all);
  EXPECT_LT((centred_gram(gram_of(G, kept)) - gram_matrix(few, mean_sample(few))).norm(), 1e-10 * expected.norm());
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
