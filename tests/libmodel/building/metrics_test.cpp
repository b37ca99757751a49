// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "libmodel/building/pca.h"
#include "libmodel/building/procrustes.h"
#include "libmodel/core/errors.h"
#include "planted.h"

namespace facewright {
namespace {

using testing::grid_template;
using testing::planted_gaussian;
using testing::random_matrix;
using testing::random_motion;
using testing::random_orthonormal;

MetricsInput input_of(SampleMatrix samples) {
  MetricsInput input;
  const Eigen::Index N = samples.cols() / 3;
  input.reference = Eigen::Map<const Vertices>(samples.row(0).data(), N, 3);
  input.alignment_weights = input.distance_weights = Eigen::VectorXd::Ones(N);
  input.samples = std::move(samples);
  return input;
}

MetricsOptions plain(int samples = 200) {
  MetricsOptions options;
  options.alignment = FoldAlignment::none;
  options.samples = samples;
  return options;
}

// Faces on a grid that differ smoothly, in the frame of the grid.
SampleMatrix grid_people(Random& random, int people, int m, int modes, double amplitude = 3) {
  const MultiresTemplate grid = grid_template(m);
  SampleMatrix samples = Eigen::Map<const Eigen::RowVectorXd>(grid.V.data(), grid.V.size()).replicate(people, 1);
  const Eigen::MatrixXd basis = random_orthonormal(random, grid.V.size(), modes);
  Eigen::MatrixXd c = amplitude * std::sqrt(double(grid.V.rows())) * random_matrix(random, people, modes);
  for (int k = 0; k < modes; ++k) c.col(k) *= std::pow(0.8, k);
  return samples + c * basis.transpose() / std::sqrt(double(modes));
}

MetricsInput grid_input(SampleMatrix samples, int m) {
  MetricsInput input = input_of(std::move(samples));
  const MultiresTemplate grid = grid_template(m);
  input.F = grid.levels.back().F;
  input.reference = grid.V;
  input.landmarks = {0, m - 1, m * m - 1};
  return input;
}

// Leave one out as it is written in the books: fit, project, measure.
Eigen::MatrixXd brute_force(const SampleMatrix& samples, const MetricsInput& input, bool align, int modes) {
  Eigen::MatrixXd errors(samples.rows(), modes + 1);
  for (Eigen::Index i = 0; i < samples.rows(); ++i) {
    SampleMatrix rest(samples.rows() - 1, samples.cols());
    rest << samples.topRows(i), samples.bottomRows(samples.rows() - 1 - i);
    Vertices x = Eigen::Map<const Vertices>(samples.row(i).data(), samples.cols() / 3, 3);
    if (align) {
      rest = generalised_procrustes(rest, input.alignment_weights, input.reference).shapes;
      const Eigen::RowVectorXd mean = rest.colwise().mean();
      x = fit_similarity(x, Eigen::Map<const Vertices>(mean.data(), x.rows(), 3), input.alignment_weights,
                         Scaling::fixed)
              .apply(x);
    }
    PcaOptions pca;
    pca.variance_share = 1;
    const PcaModel model = fit_pca(rest, pca).model;
    for (int m = 0; m <= modes; ++m) {
      const Vertices r =
          as_vertices(model.truncated(std::min<Eigen::Index>(m, model.mode_count())).project(as_vector(x)));
      errors(i, m) = (r - x).rowwise().norm().dot(input.distance_weights) / input.distance_weights.sum();
    }
  }
  return errors;
}

TEST(Compactness, IsTheCumulativeSumOfThePcaVariances) {
  Random random(1);
  const auto planted = planted_gaussian(random, 30, 300, 12);
  const CompactnessResult c = compactness(input_of(planted.samples), plain());
  PcaOptions pca;
  pca.variance_share = 1;
  const PcaModel model = fit_pca(planted.samples, pca).model;
  ASSERT_EQ(c.variance.modes.size(), 30u);
  for (int m = 0; m < 30; ++m)
    EXPECT_NEAR(c.variance.value[m], model.variances.head(std::min(m, 12)).sum(), 1e-9 * c.total_variance);
  EXPECT_EQ(c.variances.size(), 12);
  EXPECT_NEAR(c.share[12], 1, 1e-12);
  EXPECT_NEAR(c.variance.standard_error[1], std::sqrt(2.0 / 29) * model.variances[0], 1e-9 * c.total_variance);
}

TEST(Generalisation, OfARankKSetIsZeroFromKModesOn) {
  Random random(2);
  const auto planted = planted_gaussian(random, 20, 240, 5);
  const GeneralisationResult g = generalisation(input_of(planted.samples), plain());
  ASSERT_EQ(g.own.vertices.modes.back(), 18);
  EXPECT_EQ(g.fewest_training, 19);
  for (int m = 0; m <= 18; ++m) {
    const double value = g.own.vertices.value[m];
    EXPECT_TRUE(m < 5 ? value > 0.1 : value < 1e-8) << m << " modes: " << value;
  }
}

// Three strong modes and noise s in every coordinate of many. With the modes in, what is left is the noise of the
// left-out sample, that of the mean (1/n of its variance) and that of the three directions (1/n each). The mean length
// of a vector of N(0, s^2) in three coordinates is 2 sqrt(2 / pi) s.
TEST(Generalisation, OfIsotropicNoiseIsTheNoise) {
  Random random(3);
  auto planted = planted_gaussian(random, 40, 3000, 3);
  const double s = 0.05;
  planted.samples += s * random_matrix(random, 40, 3000);
  MetricsOptions options = plain();
  options.modes = {3};
  const GeneralisationResult g = generalisation(input_of(planted.samples), options);
  const double expected = 2 * std::sqrt(2 / std::numbers::pi) * s * std::sqrt(1 + 4.0 / 39);
  EXPECT_NEAR(g.own.vertices.value[0] / expected, 1, 0.01);
  EXPECT_NEAR(g.errors.mean(), g.own.vertices.value[0], 1e-12);
}

TEST(Generalisation, FromOneGramMatrixEqualsFittingEveryModelAnew) {
  Random random(4);
  MetricsInput input = input_of(planted_gaussian(random, 9, 150, 20).samples);
  input.distance_weights = random_matrix(random, 50, 1).cwiseAbs();
  const GeneralisationResult g = generalisation(input, plain());
  const Eigen::MatrixXd expected = brute_force(input.samples, input, false, 7);
  EXPECT_LT((g.own.vertices.items - expected).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Generalisation, PerFoldAlignmentEqualsProcrustesOfTheOthersAlone) {
  Random random(5);
  MetricsInput input = grid_input(grid_people(random, 8, 8, 12), 8);
  MetricsOptions options;
  options.alignment = FoldAlignment::per_fold;
  options.surface_vertices = 0;
  const Eigen::MatrixXd expected = brute_force(input.samples, input, true, 6);
  const GeneralisationResult exact = generalisation(align_samples(input, options), options);
  EXPECT_LT((exact.own.vertices.items - expected).cwiseAbs().maxCoeff(), 1e-5);  // Procrustes stops at 1e-6 mm
  options.alignment = FoldAlignment::shared;
  const GeneralisationResult shared = generalisation(align_samples(input, options), options);
  EXPECT_LT((shared.own.vertices.value - exact.own.vertices.value).cwiseAbs().maxCoeff(),
            0.02 * exact.own.vertices.value[0]);
}

TEST(Generalisation, OfFoldsLeavesEveryScanOutOnce) {
  Random random(6);
  const MetricsInput input = input_of(planted_gaussian(random, 11, 90, 30).samples);
  MetricsOptions folds = plain(), loo = plain();
  folds.folds = 11;
  EXPECT_EQ(generalisation(input, folds).own.vertices.items, generalisation(input, loo).own.vertices.items);
  folds.folds = 4;
  const GeneralisationResult g = generalisation(input, folds);
  EXPECT_EQ(g.fold_count, 4);
  EXPECT_EQ(g.fewest_training, 8);
  EXPECT_EQ(g.own.vertices.modes.back(), 7);
  EXPECT_GT(g.own.vertices.value[7], generalisation(input, loo).own.vertices.value[7]);  // fewer to learn from
}

TEST(Generalisation, AgainstTargetsMeasuresWhereTheyAre) {
  Random random(7);
  MetricsInput input = grid_input(grid_people(random, 6, 6, 4), 6);
  input.targets = input.samples;
  const MetricsOptions options;
  GeneralisationResult g = generalisation(align_samples(input, options), options);
  EXPECT_LT((g.target.vertices.items - g.own.vertices.items).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((g.target.surface.items - g.own.surface.items).cwiseAbs().maxCoeff(), 1e-9);
  for (Eigen::Index i = 0; i < input.samples.rows(); ++i)  // 7 mm aside, in each scan's own frame
    for (Eigen::Index v = 0; v < 36; ++v) input.targets(i, 3 * v + 2) += 7;
  g = generalisation(align_samples(input, options), options);
  EXPECT_GT(g.target.vertices.value.minCoeff(), 5.5);
}

TEST(Generalisation, SurfaceDistanceIsAtMostThatOfCorrespondingVertices) {
  Random random(8);
  const MetricsInput input = grid_input(grid_people(random, 7, 9, 20, 6), 9);
  const MetricsOptions options;
  const GeneralisationResult g = generalisation(align_samples(input, options), options);
  EXPECT_TRUE((g.own.surface.items.array() <= g.own.vertices.items.array() + 1e-12).all());
  EXPECT_GT(g.own.surface.value[0], 0.01);
  EXPECT_EQ(g.own.landmarks.items.cols(), 6);
}

TEST(Generalisation, ReturnsReconstructionsInTheFramesOfTheSamples) {
  Random random(9);
  SampleMatrix people = grid_people(random, 12, 6, 3);
  MetricsInput input = grid_input(people, 6);
  MetricsOptions options;
  options.alignment = FoldAlignment::none;
  options.keep = 2;
  const GeneralisationResult g = generalisation(input, options);
  ASSERT_EQ(g.kept.rows(), 2);
  EXPECT_LT((g.kept - people.topRows(2)).cwiseAbs().maxCoeff(), 1e-8);  // rank 3: exact
}

TEST(Specificity, OfAModelWithoutModesIsTheDistanceOfTheMeanToTheNearestScan) {
  Random random(10);
  const MetricsInput input = input_of(planted_gaussian(random, 12, 60, 8).samples);
  MetricsOptions options = plain(5);
  options.modes = {0};
  const SpecificityResult s = specificity(input, options);
  const Eigen::RowVectorXd mean = input.samples.colwise().mean();
  Eigen::Index nearest = 0;
  (input.samples.rowwise() - mean).rowwise().norm().minCoeff(&nearest);
  const Eigen::RowVectorXd difference = input.samples.row(nearest) - mean;
  const double expected = Eigen::Map<const Vertices>(difference.data(), 20, 3).rowwise().norm().mean();
  EXPECT_NEAR(s.nearest.vertices.value[0], expected, 1e-10);
  EXPECT_NEAR(s.nearest.vertices.standard_error[0], 0, 1e-10);
}

// Two scans span a line; with d apart, faces are at mean + g u d / sqrt(2), the scans at +-u d / 2.
TEST(Specificity, OfTwoScansIsThatOfANormalVariableToTwoPoints) {
  Random random(11);
  SampleMatrix two = 10 * random_matrix(random, 2, 30);
  for (Eigen::Index v = 1; v < 10; ++v)  // the same shift at every vertex
    two.row(1).segment<3>(3 * v) = two.row(0).segment<3>(3 * v) + two.row(1).head<3>() - two.row(0).head<3>();
  const double d = (two.row(1) - two.row(0)).head<3>().norm();
  MetricsOptions options = plain(20000);
  options.modes = {1};
  const SpecificityResult s = specificity(input_of(two), options);
  double expected = 0;  // E | |g| d / sqrt(2) - d / 2 |, by the midpoint rule
  for (double g = 0.0005; g < 8; g += 0.001)
    expected += 0.001 * 2 / std::sqrt(2 * std::numbers::pi) * std::exp(-g * g / 2) *
                std::abs(g * d / std::numbers::sqrt2 - d / 2);
  EXPECT_NEAR(s.nearest.vertices.value[0], expected, 4 * s.nearest.vertices.standard_error[0]);
}

TEST(Specificity, FindsTheNearestScanByLookingAtAll) {
  Random random(12);
  const MetricsInput input = input_of(planted_gaussian(random, 15, 45, 30).samples);
  MetricsOptions options = plain(30);
  options.modes = {4};
  const SpecificityResult s = specificity(input, options);
  // No scan can be nearer in the sum of squares than the mean distance to the nearest one allows: the same faces made
  // again with the model's own basis, up to the signs of modes.
  PcaOptions pca;
  pca.variance_share = 1;
  const PcaResult fit = fit_pca(input.samples, pca);
  std::vector<double> expected, found(s.nearest.vertices.items.data(), s.nearest.vertices.items.data() + 30);
  for (int i = 0; i < 30; ++i) {
    Random stream = Random::stream(options.seed, static_cast<std::uint64_t>(i));
    Eigen::VectorXd c(4);
    for (int k = 0; k < 4; ++k) {
      const double skew = fit.scores.col(k).array().cube().sum();
      c[k] = stream.normal() * (skew < 0 ? -1 : 1);
    }
    const Eigen::RowVectorXd face = fit.model.instance(c).transpose();
    Eigen::Index j = 0;
    (input.samples.rowwise() - face).rowwise().squaredNorm().minCoeff(&j);
    const Eigen::RowVectorXd difference = input.samples.row(j) - face;
    expected.push_back(Eigen::Map<const Vertices>(difference.data(), 15, 3).rowwise().norm().mean());
  }
  for (int i = 0; i < 30; ++i) EXPECT_NEAR(found[size_t(i)], expected[size_t(i)], 1e-8) << i;
}

TEST(Metrics, DoNotDependOnTheOrderOrTheFramesOfScans) {
  Random random(13);
  const MetricsInput input = grid_input(grid_people(random, 10, 7, 20), 7);
  MetricsInput other = input;
  other.samples = input.samples.colwise().reverse().eval();
  for (Eigen::Index i = 0; i < 10; ++i) {
    Eigen::Map<Vertices> shape(other.samples.row(i).data(), 49, 3);
    shape = random_motion(random).apply(shape);
  }
  MetricsOptions options;
  options.samples = 50;
  const MetricsInput a = align_samples(input, options), b = align_samples(other, options);
  EXPECT_LT((compactness(a, options).variance.value - compactness(b, options).variance.value).norm(), 1e-3);
  const GeneralisationResult ga = generalisation(a, options), gb = generalisation(b, options);
  EXPECT_LT((ga.own.vertices.items - gb.own.vertices.items.colwise().reverse()).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_LT((ga.own.surface.value - gb.own.surface.value).cwiseAbs().maxCoeff(), 1e-5);
  const SpecificityResult sa = specificity(a, options), sb = specificity(b, options);
  EXPECT_LT((sa.nearest.vertices.items - sb.nearest.vertices.items).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(Metrics, BytesDoNotDependOnThreads) {
  Random random(14);
  const MetricsInput input = grid_input(grid_people(random, 9, 8, 20), 8);
  for (const FoldAlignment alignment : {FoldAlignment::shared, FoldAlignment::per_fold}) {
    MetricsOptions one, four;
    one.alignment = four.alignment = alignment;
    one.samples = four.samples = 40;
    one.threads = 1;
    four.threads = 4;
    const MetricsInput a = align_samples(input, one), b = align_samples(input, four);
    const GeneralisationResult ga = generalisation(a, one), gb = generalisation(b, four);
    EXPECT_EQ(ga.own.vertices.items, gb.own.vertices.items);
    EXPECT_EQ(ga.own.surface.items, gb.own.surface.items);
    EXPECT_EQ(ga.own.landmarks.items, gb.own.landmarks.items);
    const SpecificityResult sa = specificity(a, one), sb = specificity(b, four);
    EXPECT_EQ(sa.nearest.vertices.items, sb.nearest.vertices.items);
    EXPECT_EQ(sa.nearest.surface.items, sb.nearest.surface.items);
  }
}

TEST(Metrics, OfOneToFiveOrEqualScansAreFiniteAndAsLongAsTheyCanBe) {
  Random random(15);
  const SampleMatrix people = grid_people(random, 5, 6, 10);
  MetricsOptions options;
  options.samples = 10;
  for (int n = 1; n <= 5; ++n) {
    const MetricsInput input = align_samples(grid_input(people.topRows(n), 6), options);
    EXPECT_EQ(int(compactness(input, options).variance.modes.size()), n);
    const GeneralisationResult g = generalisation(input, options);
    EXPECT_EQ(int(g.own.vertices.modes.size()), n - 1);
    EXPECT_TRUE(n == 1 || g.own.surface.value.allFinite());
    const SpecificityResult s = specificity(input, options);
    EXPECT_EQ(int(s.nearest.vertices.modes.size()), n);
    EXPECT_TRUE(s.nearest.vertices.value.allFinite() && s.nearest.surface.value.allFinite());
    if (n == 1) {
      EXPECT_NEAR(s.nearest.vertices.value[0], 0, 1e-12);
    }
  }
  const MetricsInput same = align_samples(grid_input(people.row(0).replicate(6, 1), 6), options);
  EXPECT_EQ(compactness(same, options).variances.size(), 0);
  EXPECT_LT(generalisation(same, options).own.vertices.value.maxCoeff(), 1e-9);
  EXPECT_LT(specificity(same, options).nearest.vertices.value.maxCoeff(), 1e-9);
}

TEST(Metrics, OfColoursLeaveOutWhatWasNotSeen) {
  Random random(16);
  MetricsInput input = input_of(planted_gaussian(random, 8, 60, 3).samples);
  input.visibility = SampleMatrix::Ones(8, 20);
  const Eigen::MatrixXd before = generalisation(input, plain()).own.vertices.items;
  input.visibility.row(2).tail(19).setZero();
  const Eigen::MatrixXd after = generalisation(input, plain()).own.vertices.items;
  EXPECT_EQ(before.topRows(2), after.topRows(2));
  EXPECT_GT((before.row(2) - after.row(2)).norm(), 0.01);
}

TEST(Metrics, RatioRespectsThatItemsArePairs) {
  MetricCurve a, b;
  a.modes = {1, 2, 3};
  b.modes = {2, 3, 4};
  b.items = Eigen::MatrixXd::Random(50, 3).cwiseAbs() + Eigen::MatrixXd::Ones(50, 3);
  b.value = b.items.colwise().mean();
  a.items = Eigen::MatrixXd::Ones(50, 3);
  a.items.rightCols(2) = 1.25 * b.items.leftCols(2);
  a.value = a.items.colwise().mean();
  const MetricCurve r = ratio(a, b);
  EXPECT_EQ(r.modes, (std::vector<int>{2, 3}));
  EXPECT_NEAR(r.value[0], 1.25, 1e-12);
  EXPECT_NEAR(r.standard_error[1], 0, 1e-12);  // each is a quarter more, whatever it is
  b.items.conservativeResize(49, 3);
  EXPECT_THROW(ratio(a, b), InvalidInput);
}

TEST(Metrics, RefuseWhatCannotBeMeasured) {
  Random random(17);
  MetricsInput input = input_of(planted_gaussian(random, 5, 30, 2).samples);
  MetricsOptions options = plain();
  options.folds = 1;
  EXPECT_THROW(generalisation(input, options), InvalidInput);
  options = plain();
  options.modes = {-1};
  EXPECT_THROW(compactness(input, options), InvalidInput);
  input.landmarks = {10};
  EXPECT_THROW(specificity(input, plain()), InvalidInput);
  input.landmarks.clear();
  input.targets = SampleMatrix::Zero(4, 30);
  EXPECT_THROW(generalisation(input, plain()), InvalidInput);
  input.targets.resize(0, 0);
  input.samples(3, 4) = std::nan("");
  EXPECT_THROW(compactness(input, plain()), InvalidInput);
  input.samples.resize(0, 30);
  EXPECT_THROW(compactness(input, plain()), InvalidInput);
}

}  // namespace
}  // namespace facewright
