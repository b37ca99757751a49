// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/appearance_guide.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/geometry/normals.h"
#include "libregister/registration/register_scan.h"
#include "tests/libregister/registration/painted_face.h"
#include "tests/support/matchers.h"

namespace facewright {
namespace {

const MultiresTemplate& reference() {
  static const MultiresTemplate t = bumpy_template(66, 86);
  return t;
}

// What three people who look the same but for a little noise have in common.
FaceAppearance appearance_of(const Paint& paint) {
  const AppearanceSpace space(reference());
  const std::vector<bool> seen(static_cast<size_t>(reference().V.rows()), true);
  const AppearanceFeatures f = space.features({painted(reference().V, paint), seen});
  const AppearanceFeatures noise = AppearanceFeatures::Constant(f.rows(), 3, 0.03);
  return learn_appearance({f - noise, f, f + noise}, {seen, seen, seen});
}

// The face scanned with the paint moved by (dx, dy).
MatchTarget scan_with(const Paint& paint, double dx = 0, double dy = 0) {
  Mesh m = bumpy_face(125, 163);
  m.colours = painted(m.V, [&](double x, double y) { return paint(x - dx, y - dy); });
  const Eigen::Index n = m.V.rows();
  return {std::move(m), Eigen::VectorXd::Ones(n)};
}

Eigen::Vector3d normal_of(int v) {
  static const Vertices N = vertex_normals(reference().V, reference().levels[0].F);
  return N.row(v).transpose();
}

bool along_surface(const GuideObservation& o) { return std::abs(o.direction.dot(normal_of(o.vertex))) < 0.5; }

// Where the paint of a vertex is, moved by (dx, dy) over the surface.
Eigen::Vector3d moved(int v, double dx, double dy) {
  const double x = reference().V(v, 0) + dx, y = reference().V(v, 1) + dy;
  return {x, y, bumpy_face_height(x, y)};
}

TEST(AppearanceGuide, FindsPaintThatMovedByAMillimetre) {
  const AppearanceGuide guide(reference(), appearance_of(spots));
  for (const auto& [dx, dy] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.0, -1.0}, {-0.7, 0.7}}) {
    double square = 0, moves = 0;
    int n = 0;
    for (const GuideObservation& o : guide.observe(reference().V, scan_with(spots, dx, dy))) {
      EXPECT_NEAR(o.direction.norm(), 1, 1e-9);
      EXPECT_GT(o.stddev, 0);
      if (!along_surface(o)) continue;
      const double wanted = o.direction.dot(moved(o.vertex, dx, dy));
      square += (o.value - wanted) * (o.value - wanted);
      moves += std::pow(wanted - o.direction.dot(moved(o.vertex, 0, 0)), 2);
      ++n;
    }
    ASSERT_GE(n, 16) << "four spots, some control points each, up to two directions each";
    EXPECT_LT(std::sqrt(square / n), 0.15) << dx << " " << dy;
    if (dx != 0 || dy != 0) {
      EXPECT_GT(std::sqrt(moves / n), 0.5) << "something was to be found";
    }
  }
}

TEST(AppearanceGuide, FollowsTheScansPose) {
  const AppearanceGuide guide(reference(), appearance_of(spots));
  const auto here = guide.observe(reference().V, scan_with(spots, 1, 0));
  Random random(3);
  Similarity pose = random_similarity(random);
  pose.s = 1;
  Mesh m = scan_with(spots, 1, 0).mesh();
  m.V = pose.apply(m.V);
  const auto there = guide.observe(pose.apply(reference().V), MatchTarget(m, Eigen::VectorXd::Ones(m.V.rows())));
  ASSERT_EQ(here.size(), there.size());
  for (size_t k = 0; k < here.size(); ++k) {
    EXPECT_EQ(here[k].vertex, there[k].vertex);
    EXPECT_NEAR(here[k].stddev, there[k].stddev, 1e-4);
    const double side = there[k].direction.dot(pose.R * here[k].direction) < 0 ? -1 : 1;  // eigenvectors have no sign
    EXPECT_THAT(Eigen::Vector3d(side * there[k].direction),
                MatrixNear(Eigen::Vector3d(pose.R * here[k].direction), 1e-3));
    EXPECT_NEAR(side * (there[k].value - there[k].direction.dot(pose.t)), here[k].value, 1e-3);
  }
}

TEST(AppearanceGuide, PlainSkinHasNothingToLookAt) {
  const AppearanceGuide guide(reference(), appearance_of(plain_skin));
  EXPECT_TRUE(guide.empty());
  EXPECT_TRUE(guide.observe(reference().V, scan_with(spots)).empty());
  EXPECT_TRUE(AppearanceGuide().empty());
  EXPECT_TRUE(AppearanceGuide(reference(), {}).empty());
}

TEST(AppearanceGuide, LooksNearThePaintOnlyAndKeepsItsDistances) {
  const AppearanceGuideOptions o;
  const AppearanceGuide guide(reference(), appearance_of(spots), o);
  const std::vector<int>& controls = guide.control_vertices();
  ASSERT_GE(controls.size(), 8u);
  EXPECT_LE(static_cast<int>(controls.size()), o.highest_count);
  for (size_t k = 0; k < controls.size(); ++k) {
    const Eigen::RowVector3d x = reference().V.row(controls[k]);
    bool near = false;
    for (const auto& [cx, cy] : {std::pair{35.0, 5.0}, {-30.0, 40.0}, {-35.0, -35.0}, {25.0, -45.0}})
      near = near || std::hypot(x[0] - cx, x[1] - cy) < 20;
    EXPECT_TRUE(near) << x;
    for (size_t j = 0; j < k; ++j) EXPECT_GE((x - reference().V.row(controls[j])).norm(), o.spacing);
  }
}

TEST(AppearanceGuide, AStripeTellsOnlyWhatLiesAcross) {
  const AppearanceGuide guide(reference(), appearance_of(stripe));
  double square = 0;
  int across = 0;
  for (const GuideObservation& o : guide.observe(reference().V, scan_with(stripe, 1, 1))) {
    if (!along_surface(o)) continue;
    const Eigen::Vector3d x = moved(o.vertex, 0, 0), along = (moved(o.vertex, 0, 1) - x).normalized();
    EXPECT_LT(std::abs(o.direction.dot(along)), 0.3) << x.transpose();
    if (std::abs(x[1]) > 60) continue;  // the stripe is cut at the border
    square += std::pow(o.value - o.direction.dot(moved(o.vertex, 1, 0)), 2);
    ++across;
  }
  ASSERT_GE(across, 15);
  EXPECT_LT(std::sqrt(square / across), 0.25);
}

TEST(AppearanceGuide, WhatPeopleDoNotShareIsNotBelieved) {
  FaceAppearance a = appearance_of(spots);
  const size_t shared = AppearanceGuide(reference(), a).control_vertices().size();
  for (Eigen::Index i = 0; i < a.mean.rows(); ++i)
    if (reference().V(i, 0) > 0) a.deviation.row(i).setConstant(std::numeric_limits<double>::infinity());
  const AppearanceGuide guide(reference(), a);
  EXPECT_LT(guide.control_vertices().size(), shared);
  for (const int v : guide.control_vertices()) EXPECT_LE(reference().V(v, 0), 0);
  a.deviation.setConstant(20);
  EXPECT_TRUE(AppearanceGuide(reference(), a).empty());
}

TEST(AppearanceGuide, NeverStepsFartherThanAllowed) {
  AppearanceGuideOptions o;
  o.farthest_step = 0.4;
  const AppearanceGuide guide(reference(), appearance_of(spots), o);
  double farthest = 0;
  for (const GuideObservation& g : guide.observe(reference().V, scan_with(spots, 2, 0)))
    if (along_surface(g)) farthest = std::max(farthest, std::abs(g.value - g.direction.dot(moved(g.vertex, 0, 0))));
  EXPECT_NEAR(farthest, 0.4, 1e-9);
}

TEST(AppearanceGuide, DoesNotLookWhereTheScanIsNot) {
  const AppearanceGuide guide(reference(), appearance_of(spots));
  Mesh m = scan_with(spots).mesh();
  m.V.col(2).array() += 5;  // not there yet
  EXPECT_TRUE(guide.observe(reference().V, MatchTarget(m, Eigen::VectorXd::Ones(m.V.rows()))).empty());
  m.V.col(2).array() -= 5;
  Eigen::Index n = 0;
  for (Eigen::Index f = 0; f < m.F.rows(); ++f)
    if (m.V(m.F(f, 0), 0) < 0) m.F.row(n++) = m.F.row(f);
  m.F.conservativeResize(n, 3);  // half a face
  const auto half = guide.observe(reference().V, MatchTarget(m, Eigen::VectorXd::Ones(m.V.rows())));
  EXPECT_FALSE(half.empty());
  for (const GuideObservation& o : half) EXPECT_LT(reference().V(o.vertex, 0), 0);
}

TEST(AppearanceGuide, RefusesScansWithoutColoursAndOtherLevels) {
  const AppearanceGuide guide(reference(), appearance_of(spots));
  Mesh grey = bumpy_face(65, 85);
  const MatchTarget target(grey, Eigen::VectorXd::Ones(grey.V.rows()));
  EXPECT_THROW(guide.observe(reference().V, target), InvalidInput);
  EXPECT_THROW(guide.observe(reference().V.topRows(10), scan_with(spots)), InvalidInput);
  EXPECT_THROW(AppearanceGuide(bumpy_template(31, 41), appearance_of(spots)), InvalidInput);
}

TEST(RegisterScan, DoesNotUseTheGuideOnAScanWithoutColours) {
  const AppearanceGuide guide(reference(), appearance_of(spots));
  Mesh scan = bumpy_face(125, 163);
  const Landmarks marks = locate(reference().landmarks, reference().V, reference().levels[0].F);
  const RegistrationResult with = register_scan(scan, marks, reference(), {}, &guide);
  EXPECT_EQ(with.summary.guided, 0);
  EXPECT_THAT(with.V, SameBytes(register_scan(scan, marks, reference()).V));
  scan.colours = painted(scan.V, spots);
  EXPECT_GT(register_scan(scan, marks, reference(), {}, &guide).summary.guided, 0);
  const AppearanceGuide nothing;
  EXPECT_THAT(register_scan(scan, marks, reference(), {}, &nothing).V, SameBytes(with.V));
}

// Landmarks a little wrong, paint that has moved by 1.5 mm over the very same surface: only the colours can tell.
TEST(RegisterScan, BringsPaintToItsPlace) {
  const AppearanceGuide guide(reference(), appearance_of(spots));
  Mesh scan = bumpy_face(125, 163);
  scan.colours = painted(scan.V, [](double x, double y) { return spots(x - 1.5, y); });
  Landmarks marks = locate(reference().landmarks, reference().V, reference().levels[0].F);
  Random random(5);
  for (auto& [name, mark] : marks) mark.position += random_points(random, 1, 0.5).row(0).transpose();
  const auto error = [&](const Vertices& V) {
    double sum = 0;
    for (const int v : guide.control_vertices()) sum += (V.row(v).transpose() - moved(v, 1.5, 0)).norm();
    return sum / static_cast<double>(guide.control_vertices().size());
  };
  const double with = error(register_scan(scan, marks, reference(), {}, &guide).V);
  const double without = error(register_scan(scan, marks, reference()).V);
  EXPECT_GT(without, 1);
  EXPECT_LT(with, 0.5 * without);
}

}  // namespace
}  // namespace facewright
