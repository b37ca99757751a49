// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/nicp.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "tests/libregister/registration/bumpy_face.h"
#include "tests/support/matchers.h"

namespace facewright {
namespace {

// A template of about unit diagonal, as nicp() makes them.
Mesh unit_face(int columns, int rows) {
  Mesh m = bumpy_face(columns, rows);
  m.V /= 215;
  return m;
}

NicpData towards(const Vertices& targets, double stiffness) {
  return {targets, Eigen::VectorXd::Ones(targets.rows()), {}, stiffness, 0};
}

Vertices affine_image(const Vertices& V) {
  Eigen::Matrix3d A;
  A << 1.3, 0.2, -0.1, 0.05, 0.8, 0.3, -0.2, 0.1, 1.1;
  return (V * A).rowwise() + Eigen::RowVector3d(0.3, -0.2, 0.5);
}

// Targets that no affine map reaches.
Vertices bent(const Mesh& m) { return warped(215 * m.V) / 215; }

TEST(NicpSystem, ReachesEveryAffineImageExactlyHoweverStiff) {
  const Mesh m = unit_face(15, 19);
  const NicpSystem system(m.V, m.F);
  for (const double alpha : {0.2, 5.0, 50.0, 1000.0}) {
    const NicpData data = towards(affine_image(m.V), alpha);
    const VertexTransforms X = system.solve(data);
    EXPECT_THAT(system.apply(X), VerticesNear(data.targets, 1e-6)) << alpha;  // the hold of the identity is 1e-9
    EXPECT_LT(system.energy(X, data), 1e-6) << alpha;
  }
}

TEST(NicpSystem, MovesWithItsTargets) {
  const Mesh m = unit_face(15, 19);
  const NicpSystem system(m.V, m.F);
  const Eigen::Matrix3d R = Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  const auto move = [&](const Vertices& V) -> Vertices {
    return (V * R.transpose()).rowwise() + Eigen::RowVector3d(0.1, 0.2, -0.3);
  };
  const Vertices plain = system.apply(system.solve(towards(bent(m), 2)));
  EXPECT_THAT(system.apply(system.solve(towards(move(bent(m)), 2))), VerticesNear(move(plain), 1e-6));
}

TEST(NicpSystem, ThatIsVeryStiffFindsTheBestAffineMap) {
  const Mesh m = unit_face(15, 19);
  const NicpSystem system(m.V, m.F);
  const Vertices target = bent(m);
  Eigen::MatrixXd H(m.V.rows(), 4);
  H << m.V, Eigen::VectorXd::Ones(m.V.rows());
  const Eigen::MatrixXd best = H.colPivHouseholderQr().solve(Eigen::MatrixXd(target));
  EXPECT_THAT(system.apply(system.solve(towards(target, 1e4))), VerticesNear(Vertices(H * best), 1e-5));
}

TEST(NicpSystem, ComesCloserTheLessStiffItIs) {
  const Mesh m = unit_face(15, 19);
  const NicpSystem system(m.V, m.F);
  const Vertices target = bent(m);
  double last = 1e300;
  for (const double alpha : {100.0, 10.0, 1.0, 0.1, 0.01}) {
    const double miss = (system.apply(system.solve(towards(target, alpha))) - target).norm();
    EXPECT_LT(miss, last) << alpha;
    last = miss;
  }
  EXPECT_LT(last, 1e-3);
}

TEST(NicpSystem, SolutionIsTheMinimumOfTheEnergyAsWritten) {
  const Mesh m = unit_face(11, 13);
  const NicpSystem system(m.V, m.F, 0.7);
  NicpData data = towards(bent(m), 1.5);
  data.weights[7] = 0, data.weights[20] = 0.3;
  data.landmarks = {{5, Eigen::Vector3d(0.1, 0.2, 0.3), 1}, {40, Eigen::Vector3d(-0.1, 0, 0.1), 2}};
  data.landmark_weight = 2;
  const VertexTransforms X = system.solve(data);
  const double least = system.energy(X, data);
  Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    VertexTransforms step(X.rows(), 3);
    for (Eigen::Index i = 0; i < step.size(); ++i) step.data()[i] = random.normal();
    step *= 1e-3;
    // At a minimum the energy grows alike both ways: the slope vanishes.
    const double up = system.energy(X + step, data) - least, down = system.energy(X - step, data) - least;
    EXPECT_GT(up, 0);
    EXPECT_NEAR(up, down, 1e-6 * up + 1e-9);
  }
}

TEST(NicpSystem, LandmarksPullAsTheyAreWeighed) {
  const Mesh m = unit_face(15, 19);
  const NicpSystem system(m.V, m.F);
  NicpData data = towards(m.V, 1);
  const Eigen::Vector3d there = m.V.row(100).transpose() + Eigen::Vector3d(0, 0, 0.05);
  data.landmarks = {{100, there, 1}};
  double last = 1e300;
  for (const double beta : {0.0, 1.0, 10.0, 1000.0}) {
    data.landmark_weight = beta;
    const double miss = (system.apply(system.solve(data)).row(100).transpose() - there).norm();
    EXPECT_LT(miss, last) << beta;
    last = miss;
  }
  EXPECT_LT(last, 1e-4);
}

MatchTarget warped_target() {
  Mesh scan = bumpy_face(61, 79);
  scan.V = warped(scan.V);
  return {scan, Eigen::VectorXd::Ones(scan.V.rows())};
}

std::vector<LandmarkTarget> warped_marks(const MultiresTemplate& t) {
  const Vertices there = warped(t.V);
  std::vector<LandmarkTarget> marks;
  for (const auto& [name, mark] : t.landmarks) marks.push_back({mark.vertex, there.row(mark.vertex).transpose(), 1});
  return marks;
}

TEST(Nicp, EveryStepLowersTheEnergyOfItsMatches) {
  const MultiresTemplate t = bumpy_template(21, 27);
  const NicpResult r = nicp(t.V, t.levels[0].F, warped_target(), warped_marks(t));
  ASSERT_GE(r.summary.steps.size(), 8u);
  for (const NicpStep& s : r.summary.steps) EXPECT_LE(s.energy_after, s.energy_before * (1 + 1e-9)) << s.stiffness;
}

TEST(Nicp, LaysAWarpedTemplateOntoItsSurface) {
  const MultiresTemplate t = bumpy_template(21, 27);
  const MatchTarget target = warped_target();
  const NicpResult r = nicp(t.V, t.levels[0].F, target, warped_marks(t));
  double far = 0;
  int matched = 0;
  for (Eigen::Index i = 0; i < r.V.rows(); ++i) {
    if (r.matches.origins[static_cast<size_t>(i)] != MatchOrigin::matched) continue;
    far = std::max(far, target.index().nearest(r.V.row(i).transpose().eval()).distance);
    ++matched;
  }
  EXPECT_GT(matched, t.V.rows() * 7 / 10);  // the border's matches are refused
  EXPECT_LT(far, 1.0);                      // mm; the stiffness left at the end smooths over the nose
}

TEST(Nicp, StaysWhereItIsAlreadyRight) {
  const MultiresTemplate t = bumpy_template(21, 27);
  Mesh scan = bumpy_face(21, 27);
  const MatchTarget target(scan, Eigen::VectorXd::Ones(scan.V.rows()));
  EXPECT_THAT(nicp(t.V, t.levels[0].F, target, {}).V, VerticesNear(t.V, 1e-4));
}

TEST(Nicp, RefusesTemplatesWeightsAndSchedulesThatDoNotFit) {
  const Mesh m = unit_face(5, 5);
  EXPECT_THROW(NicpSystem(m.V, Faces(0, 3)), InvalidInput);
  EXPECT_THROW(NicpSystem(m.V.topRows(10), m.F), InvalidInput);
  EXPECT_THROW(NicpSystem(m.V, m.F, 0), InvalidInput);
  const NicpSystem system(m.V, m.F);
  EXPECT_THROW(system.solve(towards(m.V.topRows(3), 1)), InvalidInput);
  EXPECT_THROW(system.solve(towards(m.V, 0)), InvalidInput);
  NicpData data = towards(m.V, 1);
  data.weights[2] = -1;
  EXPECT_THROW(system.solve(data), InvalidInput);
  data = towards(m.V, 1);
  data.targets(3, 1) = NAN;
  EXPECT_THROW(system.solve(data), InvalidInput);
  data = towards(m.V, 1);
  data.landmarks = {{static_cast<int>(m.V.rows()), Eigen::Vector3d::Zero(), 1}};
  EXPECT_THROW(system.solve(data), InvalidInput);
  NicpOptions o;
  o.landmark_weights.pop_back();
  EXPECT_THROW(nicp(m.V, m.F, warped_target(), {}, o), InvalidInput);
  o = {};
  o.highest_iterations = 0;
  EXPECT_THROW(nicp(m.V, m.F, warped_target(), {}, o), InvalidInput);
}

}  // namespace
}  // namespace facewright
