// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/prepared_sampler.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "model_fixtures.h"

namespace facewright {
namespace {

TEST(PreparedSampler, GivesTheModelsInstancesToSinglePrecision) {
  Random random(1);
  const PcaModel model = testing::random_pca(random, 333, 30, 20);
  const PreparedSampler sampler(model);
  for (int i = 0; i < 5; ++i) {
    const Eigen::VectorXd c = model.draw_coefficients(random), exact = model.instance(c);
    const Eigen::VectorXd terms = model.rescaled_basis().cwiseAbs() * c.cwiseAbs();  // what each entry is summed from
    const Eigen::VectorXd error = (as_vector(sampler.instance(c)) - exact).cwiseAbs();
    EXPECT_LT((error.array() / terms.array()).maxCoeff(), 2e-6);
  }
}

TEST(PreparedSampler, WithoutCoefficientsGivesTheMeanItself) {
  Random random(2);
  const PcaModel model = testing::random_pca(random, 51, 7, 20);
  EXPECT_EQ(as_vector(PreparedSampler(model).instance(Eigen::VectorXd())), model.mean);
}

TEST(PreparedSampler, ShorterCoefficientsMeanZeros) {
  Random random(3);
  const PcaModel model = testing::random_pca(random, 51, 9, 20);
  const PreparedSampler sampler(model);
  Eigen::VectorXd c = model.draw_coefficients(random);
  c.tail(4).setZero();
  EXPECT_EQ(sampler.instance(c.head(5)), sampler.instance(c));
}

TEST(PreparedSampler, LeadingRowsAreBitIdentical) {
  Random random(4);
  const PcaModel model = testing::random_pca(random, 333, 30, 20);
  const Eigen::VectorXd c = model.draw_coefficients(random);
  const Vertices whole = PreparedSampler(model).instance(c);
  for (const Eigen::Index n : {1, 7, 50, 110})
    EXPECT_EQ(PreparedSampler(model.leading_rows(n)).instance(c), whole.topRows(n));
}

TEST(PreparedSampler, ReusesAMatrixOfAnySize) {
  Random random(5);
  const PcaModel model = testing::random_pca(random, 51, 9, 20);
  const PreparedSampler sampler(model);
  const Eigen::VectorXd c = model.draw_coefficients(random);
  Vertices out = Vertices::Constant(3, 3, 7);
  sampler.instance(c, out);
  EXPECT_EQ(out, sampler.instance(c));
}

TEST(PreparedSampler, RefusesTooManyCoefficientsAndInconsistentModels) {
  Random random(6);
  PcaModel model = testing::random_pca(random, 51, 9, 20);
  EXPECT_THROW(PreparedSampler(model).instance(Eigen::VectorXd::Zero(10)), InvalidInput);
  model.mean.conservativeResize(50);
  EXPECT_THROW(PreparedSampler{model}, InvalidInput);
}

}  // namespace
}  // namespace facewright
