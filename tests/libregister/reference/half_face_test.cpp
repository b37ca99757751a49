// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/reference/half_face.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/core/topology.h"
#include "libregister/reference/mark_half.h"
#include "libregister/reference/reference_check.h"
#include "libregister/reference/reference_face.h"
#include "libregister/reference/remesh_half.h"
#include "libregister/reference/symmetrise.h"

namespace facewright {
namespace {

const MultiresTemplate& built_in() {
  static const MultiresTemplate reference = build_template(default_reference_face(), {3448});
  return reference;
}

const HalfFace& built_in_half() {
  static const HalfFace half = left_half(built_in(), built_in().V);
  return half;
}

// A flat sheet of n x n squares, its left edge on the midline.
HalfFace flat_sheet(int n, double spacing) {
  HalfFace h;
  const int count = (n + 1) * (n + 1);
  h.shape.resize(count, 3);
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      h.shape.row(j * (n + 1) + i) << spacing * i, spacing * j, 0;
      h.midline.push_back(i == 0);
    }
  h.neutral = h.shape;
  h.size = Eigen::VectorXd::Constant(count, spacing);
  h.slit.assign(static_cast<size_t>(count), false);
  h.source.assign(static_cast<size_t>(count), -1);
  h.F.resize(2 * n * n, 3);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      const int f = 2 * (j * n + i);
      if ((i + j) % 2 == 0) {
        h.F.row(f) << a, b, d;
        h.F.row(f + 1) << a, d, c;
      } else {
        h.F.row(f) << a, b, c;
        h.F.row(f + 1) << b, d, c;
      }
    }
  return h;
}

ReferenceFace welded(const HalfFace& half) {
  const MirroredFace whole = mirror_half(half);
  ReferenceFace face;
  face.mesh.V = whole.V;
  face.mesh.F = whole.F;
  face.mirror = whole.mirror;
  return face;
}

TEST(Symmetrise, FindsThePlaneOfASymmetricFaceInAnyPose) {
  const Vertices& V = built_in().V;
  Similarity pose;
  pose.R = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 1).normalized()).toRotationMatrix();
  pose.t = {100, 20, -40};
  const SymmetricFace face = symmetrise(pose.apply(V), V, built_in().mirror, Eigen::VectorXd::Ones(V.rows()));
  EXPECT_LT(face.rms, 1e-9);
  EXPECT_LT((face.V - V).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Symmetrise, LeavesPartnersEqualToTheLastBitAndTellsThePlantedAsymmetry) {
  const Vertices& V = built_in().V;
  Random random(4);
  Vertices bent = V;
  for (Eigen::Index v = 0; v < V.rows(); ++v)
    for (int k = 0; k < 3; ++k) bent(v, k) += random.normal();
  const SymmetricFace face = symmetrise(bent, V, built_in().mirror, Eigen::VectorXd::Ones(V.rows()));
  for (Eigen::Index v = 0; v < V.rows(); ++v) {
    const Eigen::Index m = built_in().mirror[static_cast<size_t>(v)];
    ASSERT_EQ(face.V(m, 0), m == v ? 0 : -face.V(v, 0));
    ASSERT_EQ(face.V(m, 1), face.V(v, 1));
    ASSERT_EQ(face.V(m, 2), face.V(v, 2));
  }
  // The mean of two independent draws leaves half the variance: sqrt(3 / 2).
  EXPECT_NEAR(face.rms, std::sqrt(1.5), 0.05);
  EXPECT_THROW(symmetrise(bent, V, {}, Eigen::VectorXd::Ones(V.rows())), InvalidInput);
}

TEST(Symmetrise, PairsLandmarksAndAddsMissingPartners) {
  Landmarks marks;
  marks["37"].position = {-40, 1, 50};
  marks["46"].position = {42, 3, 52};
  marks["31"].position = {0.5, -30, 80};
  marks["left_scar"].position = {20, -20, 60};
  const Landmarks s = symmetrise(marks);
  EXPECT_EQ(s.at("46").position, Eigen::Vector3d(41, 2, 51));
  EXPECT_EQ(s.at("37").position, Eigen::Vector3d(-41, 2, 51));
  EXPECT_EQ(s.at("31").position, Eigen::Vector3d(0, -30, 80));
  EXPECT_EQ(s.at("right_scar").position, Eigen::Vector3d(-20, -20, 60));
}

TEST(HalfFace, MirroredAgainIsTheWhole) {
  const ReferenceFace face = welded(built_in_half());
  EXPECT_EQ(face.mesh.V.rows(), 3448);
  EXPECT_EQ(face.mesh.F.rows(), 6736);
  const ReferenceCheck check = check_reference(face);
  EXPECT_EQ(check.euler_characteristic, 0);
  EXPECT_TRUE(check.symmetric);
  EXPECT_EQ(check.largest_asymmetry, 0);
}

double worst_distance(const HalfFace& sheet) {
  const Eigen::VectorXd d = geodesic_distances(sheet, 0);
  double worst = 0;
  for (int v = 1; v < sheet.count(); ++v)
    worst = std::max(worst, std::abs(d[v] - sheet.shape.row(v).norm()) / sheet.shape.row(v).norm());
  return worst;
}

TEST(HalfFace, GeodesicDistancesOnAFlatSheetAreStraight) {
  HalfFace sheet = flat_sheet(40, 1.5);
  EXPECT_LT(worst_distance(sheet), 1e-9);
  Random random(2);
  for (int v = 1; v < sheet.count(); ++v)
    sheet.shape.row(v) += 0.3 * Eigen::RowVector3d(random.uniform(), random.uniform(), 0);
  EXPECT_LT(worst_distance(sheet), 0.02);  // obtuse triangles make the front take edges here and there
}

TEST(HalfFace, CropFollowsTheLine) {
  const HalfFace sheet = flat_sheet(20, 3);
  Eigen::VectorXd height = sheet.shape.col(1);
  const HalfFace cut = crop(sheet, height, 31, 0);
  EXPECT_NEAR(cut.shape.col(1).maxCoeff(), 31, 1e-9);
  EXPECT_EQ(euler_characteristic(cut.F), 1);
  EXPECT_THROW(crop(sheet, height, 31, sheet.count() - 1), InvalidInput);
}

TEST(HalfFace, ClosingTheMouthMakesADiscOfTheWhole) {
  const HalfFace closed = close_mouth(built_in_half());
  EXPECT_EQ(check_reference(welded(closed)).euler_characteristic, 1);
  EXPECT_EQ(boundary_loops(welded(closed).mesh.F).size(), 1u);
}

double area(const HalfFace& half) {
  double sum = 0;
  for (Eigen::Index f = 0; f < half.F.rows(); ++f) {
    const Eigen::Vector3d a = half.shape.row(half.F(f, 0)), b = half.shape.row(half.F(f, 1)),
                          c = half.shape.row(half.F(f, 2));
    sum += 0.5 * (b - a).cross(c - a).norm();
  }
  return sum;
}

TEST(MarkOnHalf, MakesAnyPointAVertexWithoutMovingTheSurface) {
  HalfFace half = built_in_half();
  const int old_count = half.count();
  Random random(8);
  std::vector<std::pair<int, Eigen::Vector3d>> made;
  for (int i = 0; i < 20; ++i) {
    const int f = random.index(static_cast<int>(built_in_half().F.rows()));
    const Eigen::Vector3d p =
        (half.shape.row(half.F(f, 0)) + half.shape.row(half.F(f, 1)) + 2 * half.shape.row(half.F(f, 2))) / 4;
    const int before = half.count(), v = mark_on_half(half, {p, -1, false, false});
    // A new vertex is at the point itself; an old one is taken within 0.15 mm, and then none is made.
    EXPECT_EQ(half.count(), v < before ? before : before + 1);
    EXPECT_LT((half.shape.row(v).transpose() - p).norm(), v < before ? 0.15 : 1e-9);
    made.emplace_back(v, half.shape.row(v));
  }
  EXPECT_GT(half.count(), old_count + 15) << "most points are far from any vertex";
  EXPECT_EQ(half.shape.topRows(old_count), built_in_half().shape);
  EXPECT_EQ(half.neutral.topRows(old_count), built_in_half().neutral);
  for (const auto& [v, p] : made) EXPECT_EQ(half.shape.row(v).transpose(), p) << "moved by a later mark";
  EXPECT_NEAR(area(half), area(built_in_half()), 1e-9 * area(half));
  EXPECT_EQ(half.F.minCoeff(), 0);
  EXPECT_EQ(half.F.maxCoeff(), half.count() - 1);
  EXPECT_EQ(check_reference(welded(half)).euler_characteristic, 0);
}

// Landmarks nearer together than the bumps are wide: their steps must not add up.
TEST(DrawSurface, ComesAsNearAsWantedToACrowdAndNoFarther) {
  HalfFace half = flat_sheet(60, 1);
  const HalfFace before = half;
  std::vector<SurfacePull> pulls;
  for (const int i : {24, 27, 30, 33, 36})
    for (const int j : {27, 30, 33}) pulls.push_back({j * 61 + i, Eigen::Vector3d(i, j, i % 2 ? 2.5 : 3)});
  const PullSummary summary = draw_surface(half, pulls);
  EXPECT_LT(summary.rounds, 200);
  EXPECT_LE(summary.farthest, 1.0011);
  for (const SurfacePull& p : pulls) EXPECT_LE((half.shape.row(p.vertex).transpose() - p.wanted).norm(), 1.0011);
  EXPECT_LT(half.shape.col(2).maxCoeff(), 3) << "the surface passes no landmark";
  EXPECT_GT(half.shape.col(2).minCoeff(), -1) << "nor does it ring far below";
  EXPECT_TRUE(half.shape.leftCols(2) == before.shape.leftCols(2)) << "straight pulls move nothing sideways";
  EXPECT_LT((half.shape - before.shape).row(0).norm(), 1e-9) << "far away nothing happens";
}

TEST(DrawSurface, LeavesWhatIsNearEnoughAndTheMidlineInItsPlane) {
  HalfFace half = flat_sheet(20, 2);
  const HalfFace before = half;
  EXPECT_EQ(draw_surface(half, {{5, before.shape.row(5).transpose() + Eigen::Vector3d(0, 0, 0.9)}}).rounds, 0);
  EXPECT_TRUE(half.shape == before.shape);
  EXPECT_EQ(draw_surface(half, {}).farthest, 0);
  draw_surface(half, {{10 * 21 + 1, before.shape.row(10 * 21 + 1).transpose() + Eigen::Vector3d(4, 0, 0)}});
  EXPECT_NEAR(half.shape(10 * 21 + 1, 0), 2 + 3, 1e-3);
  for (int v = 0; v < half.count(); ++v)
    EXPECT_TRUE(!half.midline[static_cast<size_t>(v)] || half.shape(v, 0) == 0) << v;
}

TEST(DrawSurface, EndsWherePullsContradictEachOther) {
  HalfFace half = flat_sheet(20, 2);
  const Eigen::Vector3d at = half.shape.row(210);
  const PullSummary summary =
      draw_surface(half, {{210, at + Eigen::Vector3d(0, 0, 5)}, {210, at - Eigen::Vector3d(0, 0, 5)}});
  EXPECT_EQ(summary.rounds, PullOptions{}.most_rounds);
  EXPECT_GE(summary.farthest, 5);
  EXPECT_TRUE(half.shape.allFinite());
}

TEST(SelfIntersections, AreCountedAndAMeshThatIsNoManifoldIsRefused) {
  Vertices V(6, 3);
  V << 0, 0, 0, 2, 0, 0, 0, 2, 0, 0.5, 0.5, -1, 0.5, 0.5, 1, 1.5, 1.5, 0.2;
  Faces F(2, 3);
  F << 0, 1, 2, 3, 4, 5;
  EXPECT_EQ(count_self_intersections(V, F), 1);
  F << 0, 1, 2, 1, 0, 4;
  EXPECT_EQ(count_self_intersections(V, F), 0);
  Faces fan(3, 3);
  fan << 0, 1, 2, 1, 0, 3, 0, 1, 4;
  EXPECT_THROW(count_self_intersections(V, fan), InvalidInput);
}

TEST(RemeshHalf, HitsEveryCountExactlyAndKeepsWhatIsFixed) {
  for (const int count : {400, 845, 846, 2001, 6000}) {
    const std::vector<int> fixed{5, 100, 333};
    const RemeshedHalf made = remesh_half(built_in_half(), fixed, {count, 6});
    const ReferenceCheck check = check_reference(welded(made.half));
    EXPECT_EQ(check.vertices, count);
    EXPECT_EQ(check.euler_characteristic, 0);
    EXPECT_EQ(check.boundary_loops, 2);
    EXPECT_EQ(check.self_intersections, 0);
    EXPECT_TRUE(check.symmetric);
    EXPECT_GT(check.smallest_angle_deg, 10);
    for (size_t k = 0; k < fixed.size(); ++k)
      EXPECT_TRUE(made.half.shape.row(made.vertices_of[k]) == built_in_half().shape.row(fixed[k]));
  }
}

TEST(RemeshHalf, IsTheSameEveryTime) {
  const RemeshedHalf a = remesh_half(built_in_half(), {5}, {600, 3}), b = remesh_half(built_in_half(), {5}, {600, 3});
  EXPECT_TRUE(a.half.shape == b.half.shape);
  EXPECT_TRUE(a.half.F == b.half.F);
}

TEST(RemeshHalf, OfAFlatSheetStaysFlatAndCoversIt) {
  const RemeshedHalf made = remesh_half(flat_sheet(30, 2), {}, {500, 4});
  EXPECT_EQ(made.half.shape.col(2).cwiseAbs().maxCoeff(), 0);
  for (Eigen::Index f = 0; f < made.half.F.rows(); ++f) {
    const Eigen::Vector3d a = made.half.shape.row(made.half.F(f, 0)), b = made.half.shape.row(made.half.F(f, 1)),
                          c = made.half.shape.row(made.half.F(f, 2));
    EXPECT_GT((b - a).cross(c - a).z(), 0);
  }
  EXPECT_NEAR(area(made.half), 3600, 36);  // the two free corners may be cut off
}

TEST(RemeshHalf, RefusesCountsOutOfRange) {
  EXPECT_THROW(remesh_half(built_in_half(), {}, {100, 1}), InvalidInput);
  std::vector<int> all;
  for (int v = 0; v < built_in_half().count(); ++v) all.push_back(v);
  EXPECT_THROW(remesh_half(built_in_half(), all, {845, 1}), InvalidInput);
}

TEST(PartLips, OpensTheSlitByTheGapAndNothingElse) {
  HalfFace half = built_in_half();
  const HalfFace before = half;
  part_lips(half, 3);
  const auto [upper, lower] = lip_margins(half);
  EXPECT_GE(half.shape(upper.front(), 1) - half.shape(lower.front(), 1), 2.9);
  for (int v = 0; v < half.count(); ++v)
    EXPECT_TRUE(half.slit[static_cast<size_t>(v)] || half.shape.row(v) == before.shape.row(v)) << v;
}

}  // namespace
}  // namespace facewright
