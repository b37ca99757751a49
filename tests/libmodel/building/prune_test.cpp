// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/prune.h"

#include <gtest/gtest.h>

#include "libmodel/building/pca.h"
#include "libmodel/core/errors.h"
#include "planted.h"

namespace facewright {
namespace {

TEST(ChiSquaredQuantile, MatchesClosedFormsAndTables) {
  EXPECT_NEAR(chi_squared_quantile(0.99, 2), -2 * std::log(0.01), 1e-11);
  EXPECT_NEAR(chi_squared_quantile(0.5, 2), -2 * std::log(0.5), 1e-11);
  EXPECT_NEAR(chi_squared_quantile(0.95, 1), 3.841458820694124, 1e-11);
  EXPECT_NEAR(chi_squared_quantile(0.99, 50), 76.15389124901273, 1e-9);
  EXPECT_NEAR(chi_squared_quantile(0.01, 50), 29.706682698841, 1e-9);
  EXPECT_THROW(chi_squared_quantile(1, 5), InvalidInput);
}

TEST(FindOutliers, RemovesAsManyGaussiansAsTheQuantileSays) {
  Random random(1);
  const PruneResult result = find_outliers(testing::random_matrix(random, 20000, 50), {.quantile = 0.95});
  EXPECT_EQ(result.modes, 50);
  EXPECT_NEAR(static_cast<double>(result.removed.size()) / 20000, 0.05, 0.006);  // four standard errors
  EXPECT_EQ(result.kept.size() + result.removed.size(), 20000U);
}

TEST(FindOutliers, FindsThePlantedOneAndSaysWhy) {
  Random random(2);
  auto planted = testing::planted_gaussian(random, 300, 240, 20);
  planted.samples.row(77) += 600 * planted.basis.col(2).transpose();  // 23 standard deviations
  const Eigen::MatrixXd G = gram_matrix(planted.samples, Eigen::RowVectorXd::Zero(240));
  const PruneResult by_gram = find_outliers_by_gram(G, {.quantile = 0.9999});
  const PruneResult by_scores =
      find_outliers(fit_pca(planted.samples, {.variance_share = 1}).scores, {.quantile = 0.9999});
  for (const PruneResult& result : {by_gram, by_scores}) {
    ASSERT_FALSE(result.removed.empty());
    EXPECT_EQ(result.removed[0].sample, 77);
    EXPECT_GT(std::abs(result.removed[0].score), 10);
    EXPECT_EQ(result.removed[0].mode, 0);  // it stretches the first mode to itself
    EXPECT_LE(result.removed.size(), 3U);
  }
  EXPECT_EQ(by_gram.modes, 20);
  EXPECT_LT((by_gram.squared_mahalanobis - by_scores.squared_mahalanobis).norm(), 1e-6);
}

TEST(FindOutliers, LeavesFewSamplesAlone) {
  Random random(3);
  for (int n : {0, 1, 2, 5, 9}) {
    const Eigen::MatrixXd scores = 100 * testing::random_matrix(random, n, 5);
    EXPECT_EQ(find_outliers(scores).kept.size(), static_cast<size_t>(n));
    EXPECT_EQ(find_outliers_by_gram(scores * scores.transpose()).removed.size(), 0U);
  }
  EXPECT_THROW(find_outliers(Eigen::MatrixXd::Zero(20, 5), {.quantile = 1}), InvalidInput);
}

TEST(HeldOutErrors, AreThoseOfModelsMadeWithoutTheFold) {
  Random random(4);
  auto planted = testing::planted_gaussian(random, 24, 90, 40);
  const Eigen::MatrixXd G = gram_matrix(planted.samples, 10 * Eigen::RowVectorXd::Ones(90));
  for (const int folds : {0, 5}) {
    const Eigen::MatrixXd errors = held_out_squared_errors(G, {.folds = folds, .max_modes = 12});
    ASSERT_EQ(errors.cols(), 13);
    for (int i = 0; i < 24; ++i) {
      std::vector<int> others;
      for (int j = 0; j < 24; ++j)
        if (folds == 0 ? j != i : j % folds != i % folds) others.push_back(j);
      const PcaModel model = fit_pca(planted.samples(others, Eigen::all), {.variance_share = 1}).model;
      const Eigen::VectorXd x = planted.samples.row(i);
      for (const int m : {0, 1, 7, 12}) {
        const double expected = (model.truncated(m).project(x) - x).squaredNorm();
        EXPECT_NEAR(errors(i, m), expected, 1e-8 * errors(i, 0));
      }
    }
  }
  EXPECT_THROW(held_out_squared_errors(G.topLeftCorner(1, 1)), InvalidInput);
  EXPECT_THROW(held_out_squared_errors(G, {.folds = 25}), InvalidInput);
}

TEST(HeldOutErrors, OfDuplicatesVanish) {
  Random random(5);
  const auto planted = testing::planted_gaussian(random, 6, 90, 6);
  const SampleMatrix twice = planted.samples.replicate(2, 1);
  const Eigen::MatrixXd errors = held_out_squared_errors(gram_matrix(twice, Eigen::RowVectorXd::Zero(90)));
  EXPECT_EQ(errors.cols(), 6);
  EXPECT_LT(errors.col(5).maxCoeff(), 1e-9 * errors.col(0).maxCoeff());
}

}  // namespace
}  // namespace facewright
