// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/refine_scan_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/geometry/normals.h"
#include "tests/libmodel/fitting/toy_model.h"
#include "tests/support/matchers.h"

namespace facewright {
namespace {

/// The mean face with a bump of `height` mm on a cheek, which no mode of the model has; the fit is the mean face.
struct Bumped {
  explicit Bumped(const MorphableModel& model, double height, const Similarity& pose = {}) {
    Mesh mean = model.mean();
    const Vertices N = vertex_normals(mean.V, mean.F);
    scan.V = mean.V, scan.F = mean.F;
    bump.resize(mean.V.rows());
    for (Eigen::Index i = 0; i < mean.V.rows(); ++i) {
      bump[i] = height * std::exp(-(mean.V.row(i).head<2>() - Eigen::RowVector2d(30, -25)).squaredNorm() / 800);
      scan.V.row(i) += bump[i] * N.row(i);
    }
    scan.V = pose.apply(scan.V);
    fit.fitted = pose.apply(mean.V);
    fit.scan_from_model = pose;
  }
  Mesh scan;
  Eigen::VectorXd bump;
  FitScanResult fit;
};

TEST(RefineToScan, FollowsWhatTheModelCannotSay) {
  const MorphableModel model = toy_model();
  const Bumped b(model, 3);
  const RefinedFace refined = refine_to_scan(model, b.scan, b.fit);
  EXPECT_EQ(refined.summary.stop, FitStop::converged);
  double before = 0, after = 0;
  for (size_t i = 0; i < refined.matches.size(); ++i) {
    if (refined.matches[i] != ScanMatch::counts) continue;
    const auto row = static_cast<Eigen::Index>(i);
    before = std::max(before, std::abs(b.bump[row]));
    after = std::max(after, std::abs(refined.distances[row]));
  }
  EXPECT_GT(before, 2.5);
  EXPECT_LT(after, 0.3);  // the plate resists at the top of the bump
  EXPECT_GT(refined.summary.matched, model.vertex_count() * 3 / 4);
}

TEST(RefineToScan, LeavesAFaceThatLiesOnItsScan) {
  const MorphableModel model = toy_model();
  const Bumped b(model, 0);
  const RefinedFace refined = refine_to_scan(model, b.scan, b.fit);
  EXPECT_LT(refined.offsets.cwiseAbs().maxCoeff(), 1e-9);
}

TEST(RefineToScan, WiderSmoothingFollowsLess) {
  const MorphableModel model = toy_model();
  const Bumped b(model, 3);
  double last = 0;
  for (const double width : {2.0, 10.0, 40.0}) {
    RefineOptions options;
    options.smoothing_mm = width;
    const double left = refine_to_scan(model, b.scan, b.fit, options).distances.cwiseAbs().mean();
    EXPECT_GT(left, last);
    last = left;
  }
}

TEST(RefineToScan, OffsetsFadeWhereTheScanEnds) {
  const MorphableModel model = toy_model();
  Bumped b(model, 3);
  std::vector<int> kept;  // the scan's right half only: the bump, on the left, is not seen
  for (int f = 0; f < b.scan.F.rows(); ++f)
    if (b.scan.V(b.scan.F(f, 0), 0) < -10) kept.push_back(f);
  b.scan.F = Faces(b.scan.F(kept, Eigen::all));
  const RefinedFace refined = refine_to_scan(model, b.scan, b.fit);
  double largest = 0;
  for (Eigen::Index i = 0; i < b.bump.size(); ++i)
    if (b.fit.fitted(i, 0) > 30) largest = std::max(largest, refined.offsets.row(i).norm());
  EXPECT_LT(largest, 0.1);
}

TEST(RefineToScan, MovesWithTheScan) {
  const MorphableModel model = toy_model();
  const Similarity pose{1, rotation({0.4, 0.2, -0.3}), {100, -20, 50}};
  const Bumped here(model, 2), there(model, 2, pose);
  EXPECT_THAT(refine_to_scan(model, there.scan, there.fit).V,
              MatrixNear(pose.apply(refine_to_scan(model, here.scan, here.fit).V), 1e-6));
}

TEST(RefineToScan, RefusesWhatDoesNotFitTogether) {
  const MorphableModel model = toy_model();
  Bumped b(model, 1);
  RefineOptions options;
  options.smoothing_mm = 0;
  EXPECT_THROW(refine_to_scan(model, b.scan, b.fit, options), InvalidInput);
  b.fit.fitted.conservativeResize(10, 3);
  EXPECT_THROW(refine_to_scan(model, b.scan, b.fit), InvalidInput);
}

}  // namespace
}  // namespace facewright
