// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/subdivision/smooth_surface.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libregister/subdivision/hierarchy.h"
#include "tests/libregister/subdivision/shapes.h"

namespace facewright {
namespace {

// The unit sphere, sampled by an octahedron after uniform steps whose vertices are pushed onto it.
Mesh sampled_sphere(int steps) {
  const Mesh base = test::octahedron();
  FourEightMesh mesh(base.V, base.F, {}, pair_triangles(base.V, base.F));
  for (int i = 0; i < steps; ++i) {
    mesh.uniform_step();
    mesh.set_positions(mesh.positions().rowwise().normalized());
  }
  return {mesh.positions().rowwise().normalized(), mesh.faces(), {}, {}, {}};
}

double longest_edge(const Mesh& m) {
  double h = 0;
  for (const Edge& e : edges(m.F)) h = std::max(h, (m.V.row(e.v0) - m.V.row(e.v1)).norm());
  return h;
}

TEST(SmoothSurface, OnASphereTheLimitErrorIsOfSecondOrder) {
  double h_before = 0, error_before = 0;
  std::printf("   base h  limit error  order\n");
  for (const int refined : {1, 3, 5, 7}) {
    const Mesh base = sampled_sphere(refined);
    const double h = longest_edge(base);
    // Six more steps: the surface moves by less than a hundredth of the error from there on.
    const Vertices V = smooth_surface(base, 6).V;
    const double error = (V.rowwise().norm().array() - 1).abs().maxCoeff();
    const double order = error_before > 0 ? std::log(error_before / error) / std::log(h_before / h) : NAN;
    std::printf("%9.4f  %11.3e  %5.2f\n", h, error, order);
    if (refined > 1) {
      EXPECT_NEAR(order, 2, refined > 3 ? 0.15 : 0.4);
    }
    h_before = h;
    error_before = error;
  }
}

TEST(SmoothSurface, HasTheTrianglesOfTheInterpolatingMode) {
  const auto s = test::crooked_annulus(4, 6);
  const auto smooth = smooth_surface(s.mesh, 4, s.mirror);
  FourEightMesh mesh(s.mesh.V, s.mesh.F, s.mirror, pair_triangles(s.mesh.V, s.mesh.F, s.mirror));
  for (int i = 1; i < 4; ++i) mesh.uniform_step();
  EXPECT_TRUE(smooth.F == mesh.faces());
  EXPECT_EQ(smooth.mirror, mesh.mirror());
  EXPECT_EQ(smooth.V.rows(), mesh.vertex_count());
}

TEST(SmoothSurface, AFlatMeshStaysFlatAndUnfolded) {
  const auto s = test::annulus(4, 6);
  const auto smooth = smooth_surface(s.mesh, 6, s.mirror);
  EXPECT_EQ(smooth.V.col(2).cwiseAbs().maxCoeff(), 0);
  for (Eigen::Index f = 0; f < smooth.F.rows(); ++f) {
    const Eigen::Vector3d a = smooth.V.row(smooth.F(f, 1)) - smooth.V.row(smooth.F(f, 0));
    const Eigen::Vector3d b = smooth.V.row(smooth.F(f, 2)) - smooth.V.row(smooth.F(f, 0));
    ASSERT_GT(a.cross(b).z(), 0);
  }
}

TEST(SmoothSurface, CommutesWithRigidMotions) {
  const auto s = test::annulus(4, 6, 1.0);
  Mesh moved = s.mesh;
  const SmoothSurface here = smooth_surface(s.mesh, 5, s.mirror);
  // The pairing looks at lengths: a rotation keeps it.
  const Eigen::Matrix3d R = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  moved.V = (s.mesh.V * R.transpose()).rowwise() + Eigen::RowVector3d(1, -2, 3);
  const Vertices there = smooth_surface(moved, 5, s.mirror).V;
  const Vertices expected = (here.V * R.transpose()).rowwise() + Eigen::RowVector3d(1, -2, 3);
  EXPECT_LT((there - expected).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(SmoothSurface, SymmetricInSymmetricOut) {
  const auto s = test::crooked_annulus(5, 7);
  const auto smooth = smooth_surface(s.mesh, 5, s.mirror);
  for (Eigen::Index v = 0; v < smooth.V.rows(); ++v) {
    const Eigen::RowVector3d image = smooth.V.row(smooth.mirror[static_cast<size_t>(v)]);
    ASSERT_NEAR(image.x(), -smooth.V(v, 0), 1e-12);
    ASSERT_NEAR((image - smooth.V.row(v)).tail<2>().norm(), 0, 1e-12);
  }
}

// Largest angle between successive edges of the outer border.
double sharpest_turn(const Vertices& V, const Faces& F) {
  const std::vector<int> loop = boundary_loops(F).front();
  double turn = 0;
  for (size_t i = 0; i < loop.size(); ++i) {
    const auto at = [&](size_t j) { return Eigen::Vector3d(V.row(loop[(i + j) % loop.size()])); };
    const Eigen::Vector3d a = at(1) - at(0), b = at(2) - at(1);
    turn = std::max(turn, std::atan2(a.cross(b).norm(), a.dot(b)));
  }
  return turn;
}

TEST(SmoothSurface, TheBorderBecomesASmoothCurveOfTheBorderAlone) {
  const auto s = test::crooked_annulus(5, 7);
  double before = sharpest_turn(s.mesh.V, s.mesh.F);
  EXPECT_GT(before, 1.4);  // the corners of the grid
  for (const int steps : {2, 4, 6, 8}) {
    const SmoothSurface smooth = smooth_surface(s.mesh, steps, s.mirror);
    const double turn = sharpest_turn(smooth.V, smooth.F);
    EXPECT_LT(turn, 0.8 * before);
    before = turn;
  }
  EXPECT_LT(before, 0.4);  // half as sharp every two steps, when the edges are half as long
  // Interior heights do not matter to it.
  Mesh other = s.mesh;
  const std::vector<bool> border = boundary_vertices(other.V.rows(), other.F);
  const SmoothSurface here = smooth_surface(s.mesh, 4, s.mirror);
  for (Eigen::Index v = 0; v < other.V.rows(); ++v)
    if (!border[static_cast<size_t>(v)]) other.V(v, 2) *= 1 + 1e-9;  // small: the pairing stays
  const SmoothSurface there = smooth_surface(other, 4, s.mirror);
  const std::vector<bool> fine_border = boundary_vertices(here.V.rows(), here.F);
  for (Eigen::Index v = 0; v < here.V.rows(); ++v)
    if (fine_border[static_cast<size_t>(v)]) {
      ASSERT_TRUE(here.V.row(v) == there.V.row(v));
    }
}

TEST(SmoothSurface, RefusesNegativeStepsAndBadMeshes) {
  Mesh m = test::octahedron();
  EXPECT_THROW(smooth_surface(m, -1), InvalidInput);
  m.F(0, 0) = 17;
  EXPECT_THROW(smooth_surface(m, 2), InvalidInput);
}

}  // namespace
}  // namespace facewright
