// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/matching.h"

#include <gtest/gtest.h>

#include <functional>

#include "libmodel/core/errors.h"
#include "tests/libregister/registration/bumpy_face.h"
#include "tests/support/matchers.h"

namespace facewright {
namespace {

MatchTarget whole_target(const Mesh& m) { return {m, Eigen::VectorXd::Ones(m.V.rows())}; }

Mesh without(const Mesh& m, const std::function<bool(double x, double y)>& cut) {
  Mesh out = m;
  std::vector<Eigen::RowVector3i> kept;
  for (Eigen::Index f = 0; f < m.F.rows(); ++f) {
    const Eigen::RowVector3d c = (m.V.row(m.F(f, 0)) + m.V.row(m.F(f, 1)) + m.V.row(m.F(f, 2))) / 3;
    if (!cut(c[0], c[1])) kept.push_back(m.F.row(f));
  }
  out.F.resize(static_cast<Eigen::Index>(kept.size()), 3);
  for (size_t i = 0; i < kept.size(); ++i) out.F.row(static_cast<Eigen::Index>(i)) = kept[i];
  return out;
}

TEST(MatchLocally, FindsItselfOnItself) {
  const MultiresTemplate t = bumpy_template(31, 41);
  const Mesh dense = bumpy_face(121, 161);
  const Correspondence c = match_locally(t.V, t.levels[0].F, t.mirror, whole_target(dense));
  for (Eigen::Index i = 0; i < t.V.rows(); ++i)
    if (c.origins[static_cast<size_t>(i)] == MatchOrigin::matched) {
      EXPECT_LT((c.targets.row(i) - t.V.row(i)).norm(), 0.1);
    }
  EXPECT_GT(c.count(MatchOrigin::matched), 0.85 * static_cast<double>(t.V.rows()));
}

TEST(MatchLocally, CutCheekIsMirroredAndOthersInterpolated) {
  const MultiresTemplate t = bumpy_template(31, 41);
  // One cheek is missing on one side; a disc on the midline is missing, which no mirror can help.
  const auto cheek = [](double x, double y) { return std::hypot(x - 35, y + 10) < 18; };
  const auto middle = [](double x, double y) { return std::hypot(x, y - 55) < 9; };
  const Mesh scan = without(bumpy_face(121, 161), [&](double x, double y) { return cheek(x, y) || middle(x, y); });
  const Correspondence c = match_locally(t.V, t.levels[0].F, t.mirror, whole_target(scan));
  for (Eigen::Index i = 0; i < t.V.rows(); ++i) {
    const double x = t.V(i, 0), y = t.V(i, 1);
    const MatchOrigin o = c.origins[static_cast<size_t>(i)];
    if (std::hypot(x - 35, y + 10) < 15) {
      EXPECT_EQ(o, MatchOrigin::mirrored);
    }
    if (std::hypot(x, y - 55) < 6 && std::abs(x) < 1e-9) {
      EXPECT_EQ(o, MatchOrigin::interpolated);
    }
  }
}

TEST(MatchLocally, ReportsWhyAVertexHasNoMatch) {
  const Mesh m = plane_grid(11, 11, 40, 40);
  Mesh far = m;
  far.V.col(2).array() += 50;
  const Correspondence c = match_locally(m.V, m.F, {}, whole_target(far));
  for (const MatchStatus s : c.status) EXPECT_EQ(s, MatchStatus::too_far);
  Mesh flipped = m;
  flipped.F.col(1).swap(flipped.F.col(2));
  const Correspondence d = match_locally(m.V, m.F, {}, whole_target(flipped));
  for (const MatchStatus s : d.status) EXPECT_EQ(s, MatchStatus::normal_disagrees);
  EXPECT_EQ(d.weights.sum(), 0);
  EXPECT_TRUE(d.targets.allFinite());
}

TEST(SymmetryPlane, IsFoundInAnyPose) {
  const MultiresTemplate t = bumpy_template(21, 27);
  Random random(3);
  Similarity motion = random_similarity(random);
  motion.s = 1;
  const SymmetryPlane plane = symmetry_plane(motion.apply(t.V), t.mirror);
  EXPECT_NEAR(std::abs(plane.normal.dot(motion.R.col(0))), 1, 1e-9);
  EXPECT_NEAR(plane.offset, plane.normal.dot(motion.t), 1e-9);
}

TEST(FillHarmonic, ReproducesALinearFieldOnAFlatMesh) {
  const Mesh m = plane_grid(15, 12, 30, 20);
  Vertices field(m.V.rows(), 3);
  for (Eigen::Index i = 0; i < m.V.rows(); ++i) field.row(i) << m.V(i, 0), 2 * m.V(i, 1), m.V(i, 0) - m.V(i, 1);
  const auto border = boundary_vertices(m.V.rows(), m.F);
  const Vertices filled = fill_harmonic(m.V, m.F, field, border);
  // Clamping cotangents (1e-3 instead of 0 on the diagonals of right-angled cells) bends the field a little.
  EXPECT_THAT(filled, VerticesNear(field, 1e-2));
}

TEST(MatchLocally, RefusesAShortSymmetryTable) {
  const Mesh m = plane_grid(5, 5, 10, 10);
  EXPECT_THROW(match_locally(m.V, m.F, {0, 1}, whole_target(m)), InvalidInput);
}

}  // namespace
}  // namespace facewright
