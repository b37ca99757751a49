// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/surface/nearest.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "libmodel/core/errors.h"
#include "tests/support/matchers.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

NearestPoint brute_force(const Mesh& m, const Eigen::Vector3d& q) {
  NearestPoint best;
  best.distance = 1e300;
  for (int f = 0; f < m.F.rows(); ++f) {
    SurfacePoint p{f, nearest_on_triangle(q, m.V.row(m.F(f, 0)), m.V.row(m.F(f, 1)), m.V.row(m.F(f, 2)))};
    const Eigen::Vector3d x = position(p, m.V, m.F);
    if ((x - q).norm() < best.distance) best = {x, p, (x - q).norm()};
  }
  return best;
}

TEST(SurfaceIndex, AgreesWithBruteForce) {
  const Mesh m = icosphere(2, 40);
  const SurfaceIndex index(m.V, m.F);
  Random random(7);
  const Vertices queries = random_points(random, 300, 50);
  for (const auto& q : queries.rowwise()) {
    const NearestPoint found = index.nearest(Eigen::Vector3d(q.transpose()));
    EXPECT_NEAR(found.distance, brute_force(m, q.transpose()).distance, 1e-10);
    EXPECT_NEAR(found.where.barycentric.sum(), 1, 1e-12);
    EXPECT_THAT(position(found.where, m.V, m.F), MatrixNear(Eigen::MatrixXd(found.position), 1e-12));
  }
}

TEST(SurfaceIndex, HintsNeverChangeTheAnswer) {
  const Mesh m = icosphere(3, 40);
  const SurfaceIndex index(m.V, m.F);
  Random random(8);
  Vertices queries = random_points(random, 200, 30);
  queries.bottomRows(100) = 1.1 * m.V.topRows(100);  // over vertices, where several triangles are equally near
  for (const auto& q : queries.rowwise()) {
    const Eigen::Vector3d x = q.transpose();
    const NearestPoint plain = index.nearest(x);
    for (int k = 0; k < 5; ++k) {
      const NearestPoint hinted = index.nearest(x, random.index(static_cast<int>(m.F.rows())));
      EXPECT_EQ(hinted.where.triangle, plain.where.triangle);
      EXPECT_EQ(hinted.distance, plain.distance);
    }
  }
}

TEST(SurfaceIndex, RaysFromInsideASphereMeetItOnce) {
  const Mesh m = icosphere(3, 40);
  const SurfaceIndex index(m.V, m.F);
  Random random(9);
  const Vertices directions = random_points(random, 200, 1);
  for (Eigen::Index i = 0; i < directions.rows(); ++i) {
    const Eigen::Vector3d d = i < 100 ? directions.row(i) : m.V.row(i);  // through vertices too
    const auto hit = index.first_hit(Eigen::Vector3d::Zero(), d);
    ASSERT_TRUE(hit.has_value());
    EXPECT_NEAR(hit->distance, 40, 0.4);
    EXPECT_LT(hit->position.normalized().cross(d.normalized()).norm(), 1e-9);
  }
}

TEST(SurfaceIndex, ManyThreadsGiveTheSameBytes) {
  const Mesh m = icosphere(3, 40);
  const SurfaceIndex index(m.V, m.F);
  Random random(8);
  const Vertices Q = random_points(random, 500, 50);
  const auto one = index.nearest(Q, 1), four = index.nearest(Q, 4);
  for (size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].where.triangle, four[i].where.triangle);
    EXPECT_THAT(one[i].position, SameBytes(four[i].position));
  }
}

TEST(SurfaceIndex, RaysHitTheNearSideFirst) {
  const Mesh m = icosphere(4, 10);
  const SurfaceIndex index(m.V, m.F);
  const auto hit = index.first_hit({0, 0, 50}, {0, 0, -1});
  ASSERT_TRUE(hit.has_value());
  EXPECT_NEAR(hit->position[2], 10, 0.05);  // a facet lies at most 0.05 mm inside the sphere
  EXPECT_FALSE(index.first_hit({0, 0, 50}, {0, 0, 1}).has_value());
}

TEST(SurfaceIndex, LeavesOutDegenerateTrianglesAndRefusesNothingElse) {
  Mesh m = plane_grid(3, 3, 2, 2);
  Faces F(m.F.rows() + 1, 3);
  F << m.F, Eigen::RowVector3i(0, 0, 1);
  EXPECT_EQ(SurfaceIndex(m.V, F).nearest(Eigen::Vector3d(0, 0, 5)).distance, 5);
  EXPECT_THROW(SurfaceIndex(m.V, Faces(F.bottomRows(1))), InvalidInput);
}

TEST(PointIndex, FindsEveryPointItself) {
  Random random(9);
  const Vertices P = random_points(random, 400, 30);
  const auto found = PointIndex(P).nearest(P);
  for (int i = 0; i < 400; ++i) EXPECT_EQ(found[static_cast<size_t>(i)], i);
}

}  // namespace
}  // namespace facewright
