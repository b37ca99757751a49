// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/conform.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "libmodel/geometry/folds.h"
#include "libmodel/geometry/laplacian.h"
#include "libmodel/geometry/normals.h"
#include "tests/libregister/registration/bumpy_face.h"
#include "tests/support/matchers.h"

namespace facewright {
namespace {

Correspondence towards(const Vertices& targets, double weight = 1) {
  Correspondence c;
  c.targets = targets;
  c.weights = Eigen::VectorXd::Constant(targets.rows(), weight);
  c.origins.assign(static_cast<size_t>(targets.rows()), MatchOrigin::matched);
  c.status.assign(static_cast<size_t>(targets.rows()), MatchStatus::accepted);
  return c;
}

TEST(Conform, StaysWhereItIsAlreadyRight) {
  const Mesh m = bumpy_face(21, 27);
  const ConformResult r = conform(m.V, m.F, towards(m.V), {});
  EXPECT_THAT(r.V, VerticesNear(m.V, 1e-9));
  EXPECT_NEAR(r.summary.energy_after, 0, 1e-9);
}

TEST(Conform, LowersTheEnergyAndTheLessItSmoothsTheCloserItComes) {
  const Mesh m = bumpy_face(21, 27);
  const Vertices target = warped(m.V);
  double last = 1e300;
  for (const double length : {20.0, 5.0, 1.0}) {
    ConformOptions o;
    o.smoothing_length = length;
    const ConformResult r = conform(m.V, m.F, towards(target), {}, o);
    EXPECT_LT(r.summary.energy_after, r.summary.energy_before);
    const double miss = (r.V - target).rowwise().norm().mean();
    EXPECT_LT(miss, last);
    last = miss;
  }
  EXPECT_LT(last, 0.05);
}

TEST(Conform, SolutionIsTheMinimumOfTheEnergyAsWritten) {
  const Mesh m = bumpy_face(15, 19);
  const Vertices target = warped(m.V);
  const ConformOptions o;
  const Eigen::VectorXd A = vertex_areas(m.V, m.F);
  const Eigen::SparseMatrix<double> L = cotangent_stiffness(m.V, m.F);
  // The formula of the header, term by term, for any positions.
  const auto energy = [&](const Vertices& V) {
    const Vertices u = V - m.V;
    const double data = A.dot((V - target).rowwise().squaredNorm());
    const double smooth = o.smoothing_length * o.smoothing_length * u.cwiseProduct(Vertices(L * u)).sum();
    return data + smooth + o.rest_weight * A.mean() * u.squaredNorm();
  };
  const ConformResult r = conform(m.V, m.F, towards(target), {}, o);
  EXPECT_NEAR(r.summary.energy_before, energy(m.V), 1e-9 * energy(m.V));
  EXPECT_NEAR(r.summary.energy_after, energy(r.V), 1e-6 * energy(m.V));
  Random random(11);
  for (int trial = 0; trial < 20; ++trial)
    EXPECT_GT(energy(r.V + random_points(random, m.V.rows(), 0.01)), energy(r.V));
}

TEST(Conform, AWorkspaceThatHasSeenOtherMeshesGivesTheSameBytes) {
  ConformWorkspace workspace;
  for (const int n : {15, 15, 21, 15}) {
    const Mesh m = bumpy_face(n, 19);
    const Vertices target = warped(m.V);
    const Vertices alone = conform(m.V, m.F, towards(target), {}).V;
    EXPECT_THAT(conform(m.V, m.F, towards(target), {}, {}, {}, &workspace).V, SameBytes(alone));
    // With a stitch the pattern is another.
    const std::vector<Stitch> stitches = {{0, 100, 101, 0.5}};
    const Vertices stitched = conform(m.V, m.F, towards(target), {}, {}, stitches).V;
    EXPECT_THAT(conform(m.V, m.F, towards(target), {}, {}, stitches, &workspace).V, SameBytes(stitched));
  }
}

TEST(Conform, IsEquivariantToRigidMotion) {
  const Mesh m = bumpy_face(15, 19);
  Random random(4);
  Similarity motion = random_similarity(random);
  motion.s = 1;
  const Vertices target = warped(m.V);
  const Vertices moved = conform(motion.apply(m.V), m.F, towards(motion.apply(target)), {}).V;
  EXPECT_THAT(moved, VerticesNear(motion.apply(conform(m.V, m.F, towards(target), {}).V), 1e-8));
}

TEST(Conform, LandmarksPullWhereNoSurfaceDoes) {
  const Mesh m = bumpy_face(15, 19);
  const Eigen::Vector3d goal = m.V.row(140).transpose() + Eigen::Vector3d(0, 0, 5);
  ConformOptions o;
  o.landmark_weight = 100;
  const ConformResult r = conform(m.V, m.F, towards(m.V, 0), {{140, goal, 1}}, o);
  EXPECT_LT((r.V.row(140).transpose() - goal).norm(), 0.5);
}

TEST(Conform, RaisesStiffnessUntilNothingFolds) {
  const Mesh m = plane_grid(15, 15, 28, 28);
  Vertices target = m.V;
  target.row(112).head<2>() += Eigen::RowVector2d(5, 1);  // far across its neighbours
  ConformOptions soft;
  soft.smoothing_length = 0.3;
  soft.fold_rounds = 0;
  EXPECT_GT(conform(m.V, m.F, towards(target), {}, soft).summary.folds, 0);
  soft.fold_rounds = 8;
  EXPECT_EQ(conform(m.V, m.F, towards(target), {}, soft).summary.folds, 0);
}

TEST(Unfold, MendsAnOverturnedVertexAndLeavesTheRest) {
  Mesh m = plane_grid(9, 9, 16, 16);
  const Vertices before = m.V;
  m.V.row(40).head<2>() += Eigen::RowVector2d(3.2, 0.4);
  EXPECT_EQ(unfold(m.V, m.F), 0);
  EXPECT_THAT(m.V.topRows(18), SameBytes(Vertices(before.topRows(18))));
}

TEST(Conform, RefusesMatchesOfAnotherMesh) {
  const Mesh m = bumpy_face(5, 5);
  EXPECT_THROW(conform(m.V, m.F, towards(bumpy_face(4, 5).V), {}), InvalidInput);
}

}  // namespace
}  // namespace facewright
