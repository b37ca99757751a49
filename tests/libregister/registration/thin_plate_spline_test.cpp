// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/thin_plate_spline.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "tests/support/matchers.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

Eigen::VectorXd equal(Eigen::Index n) { return Eigen::VectorXd::Ones(n); }

TEST(ThinPlateSpline, ReproducesAffineMaps) {
  Random random(1);
  const Vertices A = random_points(random, 20, 40), X = random_points(random, 50, 40);
  Eigen::Matrix3d M = Eigen::Matrix3d::Random() + 2 * Eigen::Matrix3d::Identity();
  const auto map = [&](const Vertices& P) -> Vertices {
    return ((P * M.transpose()).rowwise() + Eigen::RowVector3d(5, -7, 9));
  };
  for (const double lambda : {1e-4, 0.1, 10.0})
    EXPECT_THAT(ThinPlateSpline(A, map(A), lambda, equal(20))(X), VerticesNear(map(X), 1e-8));
}

TEST(ThinPlateSpline, InterpolatesWithoutSmoothing) {
  Random random(2);
  const Vertices A = random_points(random, 30, 40), B = random_points(random, 30, 40);
  EXPECT_THAT(ThinPlateSpline(A, B, 0, equal(30))(A), VerticesNear(B, 1e-9));
}

TEST(ThinPlateSpline, LeaveOneOutFormulaEqualsRefits) {
  Random random(3);
  const Vertices A = random_points(random, 15, 40), B = A + random_points(random, 15, 3);
  const ThinPlateSpline all(A, B, 0.05, equal(15));
  for (Eigen::Index k = 0; k < 15; ++k) {
    Vertices a(14, 3), b(14, 3);
    for (Eigen::Index i = 0, r = 0; i < 15; ++i)
      if (i != k) a.row(r) = A.row(i), b.row(r++) = B.row(i);
    // The kernel is scaled by the mean landmark distance: give the refit the lambda that means the same smoothing.
    const auto mean_distance = [](const Vertices& X) {
      double s = 0;
      for (Eigen::Index i = 0; i < X.rows(); ++i)
        for (Eigen::Index j = 0; j < i; ++j) s += (X.row(i) - X.row(j)).norm();
      return s / (0.5 * static_cast<double>(X.rows() * (X.rows() - 1)));
    };
    const ThinPlateSpline without(a, b, 0.05 * mean_distance(A) / mean_distance(a), equal(14));
    const Eigen::RowVector3d miss = B.row(k) - without(A.row(k)).row(0);
    EXPECT_THAT(all.leave_one_out().row(k), MatrixNear(Eigen::MatrixXd(miss), 1e-8));
  }
}

TEST(ThinPlateSpline, MoreNoiseChoosesMoreSmoothing) {
  Random random(4);
  const Vertices A = random_points(random, 60, 50);
  Vertices smooth = A;
  for (Eigen::Index i = 0; i < A.rows(); ++i) smooth(i, 2) += 5 * std::sin(A(i, 0) / 40);
  const double quiet = fit_thin_plate_spline(A, smooth + random_points(random, 60, 0.05), equal(60)).lambda();
  const double loud = fit_thin_plate_spline(A, smooth + random_points(random, 60, 3), equal(60)).lambda();
  EXPECT_LT(quiet, loud);
}

TEST(ThinPlateSpline, RefusesCoplanarAndTooFewLandmarks) {
  Random random(5);
  Vertices flat = random_points(random, 10, 40);
  flat.col(2).setZero();
  EXPECT_THROW(ThinPlateSpline(flat, flat, 0.1, equal(10)), InvalidInput);
  EXPECT_THROW(ThinPlateSpline(flat.topRows(3), flat.topRows(3), 0.1, equal(3)), InvalidInput);
}

}  // namespace
}  // namespace facewright
