// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/appearance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "libmodel/core/errors.h"
#include "tests/libregister/registration/painted_face.h"
#include "tests/support/matchers.h"

namespace facewright {
namespace {

constexpr double kDarkTerm = 0.005;  // what is added to a colour before its logarithm

const MultiresTemplate& reference() {
  static const MultiresTemplate t = bumpy_template(66, 86);
  return t;
}

AppearanceSample sample_of(const Paint& paint) {
  return {painted(reference().V, paint), std::vector<bool>(static_cast<size_t>(reference().V.rows()), true)};
}

AppearanceSample scaled(AppearanceSample s, const Eigen::RowVector3d& gain) {
  s.colours = s.colours.array().rowwise() * gain.array();
  return s;
}

// A colour c >= darkest, seen with gain g, gives log(c + 0.005 / g) instead of log(c + 0.005), but for a constant. All
// channels err to the same side, so a ratio errs by no more than one of them; less its tone by at most twice, less its
// mean by at most four times as much.
double highest_change(double gain, double darkest) {
  return 4 * std::abs(std::log((darkest + kDarkTerm / gain) / (darkest + kDarkTerm)));
}

TEST(AppearanceSpace, FeaturesShowPaintAndNothingElse) {
  const AppearanceSpace space(reference());
  EXPECT_THAT(space.features(sample_of(plain_skin)), MatrixNear(AppearanceFeatures::Zero(67 * 87, 3), 1e-12));
  const AppearanceFeatures f = space.features(sample_of(spots));
  EXPECT_LT(f.col(0).minCoeff(), -0.3);  // spots are darker than the skin
  EXPECT_GT(f.col(1).maxCoeff(), 0.05);  // and redder
  EXPECT_GT(f.col(2).maxCoeff(), 0.05);
}

TEST(AppearanceSpace, TheLightsStrengthDoesNotMatter) {
  const AppearanceSpace space(reference());
  const AppearanceFeatures f = space.features(sample_of(spots));
  for (const double gain : {0.6, 0.8, 1.6}) {
    const AppearanceFeatures g = space.features(scaled(sample_of(spots), Eigen::RowVector3d::Constant(gain)));
    EXPECT_THAT(g.col(0), MatrixNear(Eigen::MatrixXd(f.col(0)), 1e-10)) << gain;
    const double darkest = sample_of(spots).colours.minCoeff();
    EXPECT_THAT(g, MatrixNear(f, highest_change(gain, darkest))) << gain;
    EXPECT_LT(highest_change(gain, darkest), 0.4) << "a tolerance that tells nothing";
    EXPECT_LT((g - f).rowwise().norm().mean(), 0.02) << gain;
  }
}

TEST(AppearanceSpace, TheTonesOfSkinAndLightDoNotMatterToTheRatios) {
  const AppearanceSpace space(reference());
  const Eigen::RowVector3d tone(1.3, 0.8, 0.6);
  const AppearanceFeatures f = space.features(sample_of(spots)), g = space.features(scaled(sample_of(spots), tone));
  const double darkest = sample_of(spots).colours.minCoeff();
  EXPECT_THAT(g.rightCols(2), MatrixNear(Eigen::MatrixXd(f.rightCols(2)), highest_change(0.6, darkest)));
  EXPECT_LT((g - f).rightCols(2).rowwise().norm().mean(), 0.02);  // the tone itself: log(1.3 / 0.6) = 0.77
}

TEST(AppearanceSpace, AWideFlushDisappears) {
  const AppearanceSpace space(reference());
  const auto flush = [](double x, double y) -> Eigen::RowVector3d {
    return plain_skin(x, y).cwiseProduct(Eigen::RowVector3d(1, 1 - 0.25 * blob(x - 30, y + 10, 25), 1));
  };
  const double raw = std::log(1 / 0.75);
  EXPECT_LT(space.features(sample_of(flush)).col(2).cwiseAbs().maxCoeff(), 0.5 * raw);
}

TEST(AppearanceSpace, ColoursThatAreNotSeenTellNothing) {
  const AppearanceSpace space(reference());
  AppearanceSample s = sample_of(spots);
  Random random(1);
  for (size_t i = 0; i < s.seen.size(); ++i) s.seen[i] = random.uniform() > 0.2;
  const AppearanceFeatures f = space.features(s);
  for (size_t i = 0; i < s.seen.size(); ++i)
    if (!s.seen[i]) s.colours.row(static_cast<Eigen::Index>(i)) = 100 * random_points(random, 1, 1).cwiseAbs();
  EXPECT_THAT(space.features(s), SameBytes(f));
}

TEST(AppearanceSpace, APartlySeenFaceOfAnyToneIsPlainWhereItIsPlain) {
  const AppearanceSpace space(reference());
  AppearanceSample s = scaled(sample_of(plain_skin), Eigen::RowVector3d(1.3, 0.8, 0.4));
  for (size_t i = 0; i < s.seen.size(); ++i) s.seen[i] = reference().V(static_cast<Eigen::Index>(i), 0) < 20;
  EXPECT_THAT(space.features(s), MatrixNear(AppearanceFeatures::Zero(67 * 87, 3), 1e-9));
}

TEST(AppearanceSpace, RefusesColoursOfAnotherLevel) {
  const AppearanceSpace space(reference());
  AppearanceSample s = sample_of(spots);
  s.seen.pop_back();
  EXPECT_THROW(space.features(s), InvalidInput);
  EXPECT_THROW(AppearanceSpace(MultiresTemplate{}), InvalidInput);
}

TEST(LearnAppearance, TakesMedianAndDeviationOfThoseWhoAreSeen) {
  const AppearanceFeatures one = AppearanceFeatures::Ones(3, 3);
  const std::vector<AppearanceFeatures> people{1 * one, 2 * one, 7 * one, 3 * one, 3 * one};
  // First vertex: seen of all; second: of three; third: of two.
  const std::vector<std::vector<bool>> seen{
      {true, true, true}, {true, true, true}, {true, true, false}, {true, false, false}, {true, false, false}};
  const FaceAppearance a = learn_appearance(people, seen);
  const double all = std::sqrt((4.0 + 1 + 16 + 0 + 0) / 5), three = std::sqrt((1.0 + 0 + 25) / 3);
  for (int c = 0; c < kAppearanceFeatures; ++c) {
    EXPECT_DOUBLE_EQ(a.mean(0, c), 3);
    EXPECT_DOUBLE_EQ(a.deviation(0, c), all);
    EXPECT_DOUBLE_EQ(a.mean(1, c), 2);
    EXPECT_DOUBLE_EQ(a.deviation(1, c), three);
    EXPECT_EQ(a.deviation(2, c), std::numeric_limits<double>::infinity());
  }
}

TEST(LearnAppearance, OneStrangerDoesNotMoveTheMean) {
  AppearanceFeatures usual = AppearanceFeatures::Constant(2, 3, 0.2), stranger = AppearanceFeatures::Constant(2, 3, 90);
  const std::vector<bool> all(2, true);
  EXPECT_THAT(learn_appearance({usual, stranger, usual}, {all, all, all}).mean, SameBytes(usual));
}

TEST(LearnAppearance, NeedsThreePeople) {
  const AppearanceFeatures f = AppearanceFeatures::Ones(4, 3);
  const std::vector<bool> all(4, true);
  EXPECT_TRUE(learn_appearance({}, {}).empty());
  EXPECT_TRUE(learn_appearance({f, f}, {all, all}).empty());
  EXPECT_FALSE(learn_appearance({f, f, f}, {all, all, all}).empty());
}

}  // namespace
}  // namespace facewright
