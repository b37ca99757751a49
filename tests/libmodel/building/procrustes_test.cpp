// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/procrustes.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "planted.h"

namespace facewright {
namespace {

using testing::grid_template;
using testing::random_matrix;
using testing::random_motion;

Eigen::RowVectorXd row_of(const Vertices& V) { return Eigen::Map<const Eigen::RowVectorXd>(V.data(), V.size()); }
Vertices shape_of(const SampleMatrix& shapes, Eigen::Index i) {
  return Eigen::Map<const Vertices>(shapes.row(i).data(), shapes.cols() / 3, 3);
}

struct Faces12 : ::testing::Test {
  Faces12() : shapes(12, t.V.size()) {
    for (int i = 0; i < 12; ++i)
      shapes.row(i) = row_of(random_motion(random).apply((1 + 0.02 * i) * t.V + random_matrix(random, 81, 3)));
  }
  Random random{1};
  MultiresTemplate t = grid_template(9);
  Eigen::VectorXd weights = Eigen::VectorXd::LinSpaced(81, 0.1, 2);
  SampleMatrix shapes;
};

using Procrustes = Faces12;

TEST_F(Procrustes, MeanLiesInTheFrameOfTheReferenceAndTurnsWithIt) {
  const Similarity turn = random_motion(random);
  for (const Scaling scaling : {Scaling::fixed, Scaling::free}) {
    const ProcrustesOptions options{.scaling = scaling};
    const ProcrustesResult result = generalised_procrustes(shapes, weights, t.V, options);
    EXPECT_TRUE(result.summary.converged);
    const Similarity left = fit_similarity(result.mean, t.V, weights, Scaling::fixed);
    EXPECT_LT((left.R - Eigen::Matrix3d::Identity()).norm(), 1e-6);
    EXPECT_LT(left.t.norm(), 1e-5);
    const ProcrustesResult turned = generalised_procrustes(shapes, weights, turn.apply(t.V), options);
    for (int i = 0; i < 12; ++i)
      EXPECT_LT((turn.apply(shape_of(result.shapes, i)) - shape_of(turned.shapes, i)).cwiseAbs().maxCoeff(), 1e-5);
  }
}

TEST_F(Procrustes, IsAFixedPoint) {
  const ProcrustesResult result = generalised_procrustes(shapes, weights, t.V);
  for (int i = 0; i < 12; ++i) {
    const Similarity step = fit_similarity(shape_of(result.shapes, i), result.mean, weights, Scaling::fixed);
    EXPECT_LT((step.R - Eigen::Matrix3d::Identity()).norm() + step.t.norm(), 1e-4);
  }
  const ProcrustesResult again = generalised_procrustes(result.shapes, weights, t.V);
  EXPECT_LE(again.summary.iterations, 3);
  EXPECT_LT((again.shapes - result.shapes).cwiseAbs().maxCoeff(), 1e-5);
}

TEST_F(Procrustes, NoMotionOfAScanChangesIt) {
  SampleMatrix moved = shapes;
  for (int i = 0; i < 12; ++i) moved.row(i) = row_of(random_motion(random).apply(shape_of(shapes, i)));
  for (const Scaling scaling : {Scaling::fixed, Scaling::free}) {
    const ProcrustesOptions options{.scaling = scaling};
    EXPECT_LT((generalised_procrustes(shapes, weights, t.V, options).shapes -
               generalised_procrustes(moved, weights, t.V, options).shapes)
                  .cwiseAbs()
                  .maxCoeff(),
              1e-5);
  }
}

TEST_F(Procrustes, FreeScaleReportsTheSizeOfEveryScan) {
  SampleMatrix sizes(5, t.V.size());
  for (int i = 0; i < 5; ++i) sizes.row(i) = row_of(random_motion(random).apply((0.8 + 0.1 * i) * t.V));
  const ProcrustesResult result = generalised_procrustes(sizes, weights, t.V, {.scaling = Scaling::free});
  for (int i = 0; i < 5; ++i)
    EXPECT_NEAR(result.mean_from_scans[static_cast<size_t>(i)].s * (0.8 + 0.1 * i), 1, 1e-9);  // the mean size is 1
}

TEST_F(Procrustes, VerticesOfWeightZeroHaveNoSay) {
  weights.head(30).setZero();
  SampleMatrix wild = shapes;
  wild.leftCols(90) += 50 * random_matrix(random, 12, 90);
  const ProcrustesResult a = generalised_procrustes(shapes, weights, t.V),
                         b = generalised_procrustes(wild, weights, t.V);
  EXPECT_LT((a.shapes - b.shapes).rightCols(153).cwiseAbs().maxCoeff(), 1e-5);
}

TEST_F(Procrustes, GuessesAtUnseenVerticesPullLess) {
  // Faces that differ by motion alone, where a quarter of each was not seen and is guessed wrong.
  SampleMatrix visibility = SampleMatrix::Ones(12, 81);
  for (int i = 0; i < 12; ++i) {
    Vertices face = t.V;
    for (int v = 7 * i; v < 7 * i + 20; ++v) {
      face(v % 81, 2) += 8;
      visibility(i, v % 81) = 0;
    }
    shapes.row(i) = row_of(random_motion(random).apply(face));
  }
  const auto error = [&](const ProcrustesResult& result) {
    double sum = 0;
    for (int i = 0; i < 12; ++i)
      for (int v = 0; v < 81; ++v)
        if (visibility(i, v) == 1) sum += (result.shapes.row(i).segment<3>(3 * v) - t.V.row(v)).squaredNorm();
    return std::sqrt(sum / visibility.sum());
  };
  const ProcrustesResult plain = generalised_procrustes(shapes, weights, t.V);
  const ProcrustesResult aware = generalised_procrustes(shapes, weights, t.V, {}, visibility);
  const ProcrustesResult strict = generalised_procrustes(shapes, weights, t.V, {.unseen_weight = 1e-6}, visibility);
  EXPECT_TRUE(aware.summary.converged);
  EXPECT_LT(error(aware), 0.5 * error(plain));
  EXPECT_LT(error(strict), 1e-3);
  EXPECT_GT(aware.summary.unseen_share, 0.15);
  const ProcrustesResult all = generalised_procrustes(shapes, weights, t.V, {}, SampleMatrix::Ones(12, 81));
  EXPECT_LT((all.shapes - plain.shapes).cwiseAbs().maxCoeff(), 1e-9);
}

TEST_F(Procrustes, RefusesMasksThatDoNotFit) {
  EXPECT_THROW(generalised_procrustes(shapes, weights, t.V, {}, SampleMatrix::Ones(11, 81)), InvalidInput);
  EXPECT_THROW(generalised_procrustes(shapes, weights, t.V, {}, SampleMatrix::Constant(12, 81, 2)), InvalidInput);
  EXPECT_THROW(generalised_procrustes(shapes, weights, t.V, {.unseen_weight = 0}), InvalidInput);
  EXPECT_THROW(generalised_procrustes(shapes, -weights, t.V), InvalidInput);
}

}  // namespace
}  // namespace facewright
