// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "libregister/registration/matching.h"
#include "tests/support/matchers.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

// A flat reference of 21 x 21 vertices 2 mm apart, x = -20 .. 20, and 0.5 mm above it a larger scan that ends at
// x = 10, has a square hole |x|, |y| < 3, and is not to be relied on about (-12, 12). Every count is known.
struct FlatCase {
  Mesh reference = plane_grid(20, 20, 40, 40);
  std::vector<int> mirror;
  Mesh scan = plane_grid(80, 120, 40, 60);
  Eigen::VectorXd reliability;

  FlatCase() {
    reference.V.rowwise() -= Eigen::RowVector3d(20, 20, 0);
    scan.V.rowwise() -= Eigen::RowVector3d(30, 30, -0.5);
    mirror.resize(static_cast<size_t>(reference.V.rows()));
    for (int i = 0; i < reference.V.rows(); ++i)
      for (int j = 0; j < reference.V.rows(); ++j)
        if (reference.V(i, 0) == -reference.V(j, 0) && reference.V(i, 1) == reference.V(j, 1))
          mirror[static_cast<size_t>(i)] = j;
    Faces kept(scan.F.rows(), 3);
    Eigen::Index n = 0;
    for (Eigen::Index f = 0; f < scan.F.rows(); ++f) {
      const Eigen::RowVector3d c = (scan.V.row(scan.F(f, 0)) + scan.V.row(scan.F(f, 1)) + scan.V.row(scan.F(f, 2))) / 3;
      if (std::abs(c[0]) > 3 || std::abs(c[1]) > 3) kept.row(n++) = scan.F.row(f);
    }
    scan.F = kept.topRows(n);
    reliability = Eigen::VectorXd::Ones(scan.V.rows());
    for (Eigen::Index i = 0; i < scan.V.rows(); ++i)
      if (std::abs(scan.V(i, 0) + 12) < 1.2 && std::abs(scan.V(i, 1) - 12) < 1.2) reliability[i] = 0;
  }

  Correspondence match(bool use_mirror, const std::vector<int>& table) const {
    MatchOptions o;
    o.border_distance = 0.6;
    o.use_mirror = use_mirror;
    return match_locally(reference.V, reference.F, table, MatchTarget(scan, reliability), o);
  }
};

std::map<MatchStatus, int> status_counts(const Correspondence& c) {
  std::map<MatchStatus, int> n;
  for (const MatchStatus s : c.status) ++n[s];
  return n;
}

TEST(MatchFallbacks, EveryVertexOfAConstructedCaseIsCounted) {
  const FlatCase flat;
  const Correspondence c = flat.match(true, flat.mirror);
  const std::map<MatchStatus, int> expected{
      {MatchStatus::accepted, 21 * 15 - 9 - 1},  // x <= 8 without the hole and the bad place
      {MatchStatus::too_far, 21 * 3},            // x = 16, 18, 20: 6 mm and more
      {MatchStatus::on_border, 21 * 3 + 9},      // x = 10, 12, 14, and the hole
      {MatchStatus::unreliable, 1}};
  EXPECT_EQ(status_counts(c), expected);
  EXPECT_EQ(c.count(MatchOrigin::matched), 305);
  EXPECT_EQ(c.count(MatchOrigin::mirrored), 21 * 6 - 1);  // x >= 10 but for the bad place's twin
  EXPECT_EQ(c.count(MatchOrigin::interpolated), 9 + 2);   // the hole lies across the midline
  EXPECT_EQ(c.count(MatchOrigin::free), 0);
}

TEST(MatchFallbacks, WithoutAMirrorTheRestIsInterpolated) {
  const FlatCase flat;
  for (const Correspondence& c : {flat.match(false, flat.mirror), flat.match(true, {})}) {
    EXPECT_EQ(c.count(MatchOrigin::matched), 305);
    EXPECT_EQ(c.count(MatchOrigin::mirrored), 0);
    EXPECT_EQ(c.count(MatchOrigin::interpolated), 441 - 305);
    EXPECT_EQ(c.count(MatchOrigin::free), 0);
  }
}

TEST(MatchFallbacks, AllFollowTheScanAndCountForLessTheLessIsKnown) {
  const FlatCase flat;
  const Correspondence c = flat.match(true, flat.mirror);
  Vertices expected = flat.reference.V;
  expected.col(2).setConstant(0.5);
  EXPECT_THAT(c.targets, VerticesNear(expected, 1e-9));
  const MatchOptions usual;
  const double matched = std::exp(-0.5 * std::pow(0.5 / usual.welsch_width, 2));  // weight of an own match, 0.5 mm off
  const double mean = matched * (305 + 125 * usual.mirrored_weight) / (305 + 125);
  for (size_t i = 0; i < c.origins.size(); ++i) {
    const double expected_weight = c.origins[i] == MatchOrigin::matched    ? matched
                                   : c.origins[i] == MatchOrigin::mirrored ? usual.mirrored_weight * matched
                                                                           : usual.interpolated_weight * mean;
    EXPECT_NEAR(c.weights[static_cast<Eigen::Index>(i)], expected_weight, 1e-9) << i;
  }
}

}  // namespace
}  // namespace facewright
