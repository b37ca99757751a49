// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/subdivision/four_eight_mesh.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/core/topology.h"
#include "tests/libregister/subdivision/shapes.h"

namespace facewright {
namespace {

using test::annulus;
using test::octahedron;

FourEightMesh make(const Mesh& m, const std::vector<int>& mirror = {}) {
  return {m.V, m.F, mirror, pair_triangles(m.V, m.F, mirror)};
}

// Manifold (edges() throws otherwise) and every edge used once in each direction: no T-vertex, one orientation.
void expect_conforming(const FourEightMesh& mesh, int euler) {
  const Faces F = mesh.faces();
  std::map<std::pair<int, int>, int> half_edges;
  for (int f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) ++half_edges[{F(f, k), F(f, (k + 1) % 3)}];
  for (const auto& [edge, count] : half_edges) ASSERT_EQ(count, 1);
  EXPECT_EQ(euler_characteristic(F), euler);
  EXPECT_EQ(mesh.face_count(), 2 * mesh.vertex_count() - boundary_edge_count(F) - 2 * euler);
}

void expect_symmetric(const FourEightMesh& mesh) {
  const Vertices V = mesh.positions();
  EXPECT_NO_THROW(mirrored_triangles(mesh.faces(), mesh.mirror()));
  for (int v = 0; v < V.rows(); ++v) {
    const Eigen::RowVector3d image = V.row(mesh.mirror()[v]);
    ASSERT_NEAR(image.x(), -V(v, 0), 1e-12);
    ASSERT_NEAR((image - V.row(v)).tail<2>().norm(), 0, 1e-12);
  }
}

TEST(PairTriangles, CoversEveryTriangleOnce) {
  const auto s = annulus(4, 6);
  for (const auto& mirror : {std::vector<int>{}, s.mirror}) {
    const auto pairing = pair_triangles(s.mesh.V, s.mesh.F, mirror);
    std::vector<int> seen(static_cast<size_t>(s.mesh.F.rows()), 0);
    for (const auto& b : pairing.blocks) {
      ++seen[b.f];
      if (b.is_pair()) ++seen[b.g];
    }
    EXPECT_THAT(seen, testing::Each(1));
    EXPECT_EQ(2 * pairing.pairs + pairing.singles, s.mesh.F.rows());
  }
}

TEST(PairTriangles, PairsASquareAcrossItsDiagonal) {
  Mesh m;
  m.V.resize(4, 3);
  m.V << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0;
  m.F.resize(2, 3);
  m.F << 0, 1, 2, 0, 2, 3;
  const auto pairing = pair_triangles(m.V, m.F);
  ASSERT_EQ(pairing.pairs, 1);
  EXPECT_EQ(pairing.blocks[0].a, 0);
  EXPECT_EQ(pairing.blocks[0].b, 2);
}

TEST(PairTriangles, ALongBoundaryEdgeLeavesItsTriangleSingle) {
  Mesh m;
  m.V.resize(4, 3);
  m.V << 0, 0, 0, 4, 0, 0, 2, 0.5, 0, 2, 3, 0;
  m.F.resize(2, 3);
  m.F << 0, 1, 2, 0, 2, 3;
  const auto pairing = pair_triangles(m.V, m.F);
  EXPECT_EQ(pairing.pairs, 0);
  EXPECT_EQ(pairing.singles, 2);
}

TEST(PairTriangles, ReachesAWantedNumberOfSinglesBothWays) {
  const auto s = test::crooked_annulus(6, 8, 2);
  for (const auto& mirror : {std::vector<int>{}, s.mirror}) {
    const int greedy = pair_triangles(s.mesh.V, s.mesh.F, mirror).singles;
    ASSERT_GT(greedy, 8);
    for (const int change : {-6, -4, -2, 2, 4, 14}) {
      const auto pairing = pair_triangles(s.mesh.V, s.mesh.F, mirror, greedy + change);
      EXPECT_EQ(pairing.singles, greedy + change);
      const FourEightMesh mesh(s.mesh.V, s.mesh.F, mirror, pairing);
      expect_conforming(mesh, 0);
      if (!mirror.empty()) expect_symmetric(mesh);
    }
  }
}

TEST(FourEightMesh, TwoStepsGiveTheCountsOfTheFormula) {
  const auto s = annulus(5, 7);
  const auto pairing = pair_triangles(s.mesh.V, s.mesh.F, s.mirror);
  FourEightMesh mesh(s.mesh.V, s.mesh.F, s.mirror, pairing);
  const int V = static_cast<int>(s.mesh.V.rows()), F = static_cast<int>(s.mesh.F.rows());
  EXPECT_EQ(mesh.vertex_count(), V + pairing.pairs + pairing.singles);
  EXPECT_EQ(mesh.face_count(), 2 * F + pairing.singles);
  EXPECT_EQ(boundary_edge_count(mesh.faces()), boundary_edge_count(s.mesh.F));
  mesh.uniform_step();
  EXPECT_EQ(mesh.vertex_count(), V + static_cast<int>(edges(s.mesh.F).size()) + pairing.singles);
  EXPECT_EQ(mesh.face_count(), 4 * F + 2 * pairing.singles);
  EXPECT_EQ(boundary_edge_count(mesh.faces()), 2 * boundary_edge_count(s.mesh.F));
  expect_conforming(mesh, 0);
  expect_symmetric(mesh);
}

TEST(FourEightMesh, EveryFurtherUniformStepDoublesTheTriangles) {
  FourEightMesh mesh = make(octahedron());
  for (int step = 0; step < 8; ++step) {
    const int before = mesh.face_count();
    mesh.uniform_step();
    EXPECT_EQ(mesh.face_count(), 2 * before);
    EXPECT_EQ(mesh.vertex_count(), mesh.face_count() / 2 + 2);
  }
  expect_conforming(mesh, 2);
}

TEST(FourEightMesh, StaysConformingThroughTenThousandRandomBisections) {
  FourEightMesh mesh = make(octahedron());
  Random random(1);
  for (int i = 0; i < 10000; ++i) {
    const int t = random.index(mesh.face_count()), expected = mesh.cost(t), before = mesh.vertex_count();
    ASSERT_EQ(mesh.bisect(t).vertices, expected);
    ASSERT_EQ(mesh.vertex_count() - before, expected);
  }
  expect_conforming(mesh, 2);
}

TEST(FourEightMesh, SymmetricInSymmetricOutThroughRandomBisections) {
  const auto s = annulus(4, 6, 1.0);
  FourEightMesh mesh = make(s.mesh, s.mirror);
  Random random(2);
  for (int i = 0; i < 3000; ++i) {
    const int t = random.index(mesh.face_count()), expected = mesh.cost(t);
    ASSERT_EQ(mesh.bisect(t).vertices, expected);
  }
  expect_conforming(mesh, 0);
  expect_symmetric(mesh);
  EXPECT_EQ(boundary_edge_count(mesh.faces()) % 2, 0);
}

TEST(FourEightMesh, BisectingOneSpotForEverNeitherStopsNorBreaks) {
  const auto s = annulus(3, 4);
  FourEightMesh mesh = make(s.mesh);
  for (int i = 0; i < 60; ++i) mesh.bisect(0);  // 30 halvings of one corner: chains of many levels
  expect_conforming(mesh, 0);
}

TEST(FourEightMesh, FlatStaysFlatAndOriented) {
  const auto s = annulus(4, 4);
  FourEightMesh mesh = make(s.mesh);
  Random random(4);
  for (int i = 0; i < 500; ++i) mesh.bisect(random.index(mesh.face_count()));
  const Vertices V = mesh.positions();
  const Faces F = mesh.faces();
  EXPECT_EQ(V.col(2).cwiseAbs().maxCoeff(), 0);
  double area = 0, base_area = 0;
  const auto signed_area = [](const Vertices& P, const Faces& G, int f) {
    const Eigen::Vector3d a = P.row(G(f, 1)) - P.row(G(f, 0)), b = P.row(G(f, 2)) - P.row(G(f, 0));
    return 0.5 * a.cross(b).z();
  };
  for (int f = 0; f < F.rows(); ++f) {
    ASSERT_GT(signed_area(V, F, f), 0);
    area += signed_area(V, F, f);
  }
  for (int f = 0; f < s.mesh.F.rows(); ++f) base_area += signed_area(s.mesh.V, s.mesh.F, f);
  EXPECT_NEAR(area, base_area, 1e-9);
}

TEST(FourEightMesh, ReplayOfTheJournalGivesTheMesh) {
  const auto s = annulus(4, 6, 1.0);
  FourEightMesh mesh = make(s.mesh, s.mirror);
  Random random(5);
  for (int i = 0; i < 1000; ++i) mesh.bisect(random.index(mesh.face_count()));
  const Vertices replayed = refine_field(mesh.parents(), mesh.base_count(), s.mesh.V, mesh.vertex_count());
  EXPECT_EQ((replayed - mesh.positions()).cwiseAbs().maxCoeff(), 0);
}

TEST(FourEightMesh, MovedVerticesBendTheBaseEdges) {
  const auto s = annulus(4, 4);
  FourEightMesh mesh = make(s.mesh);
  double flat = 0, bent = 0;
  for (int t = 0; t < mesh.face_count(); ++t) flat = std::max(flat, mesh.base_edge(t).bend);
  Vertices V = mesh.positions();
  V.col(2) = -0.1 * V.col(0).cwiseAbs2();
  mesh.set_positions(V);
  for (int t = 0; t < mesh.face_count(); ++t) bent = std::max(bent, mesh.base_edge(t).bend);
  EXPECT_NEAR(flat, 0, 1e-12);
  EXPECT_GT(bent, 0.05);
}

TEST(FourEightMesh, RefusesMeshesItCannotKeep) {
  const auto s = annulus(3, 4);
  Mesh bad = s.mesh;
  bad.F.row(0) = Eigen::RowVector3i(bad.F(0, 0), bad.F(0, 2), bad.F(0, 1));  // one triangle turned over
  EXPECT_THROW(make(bad), InvalidInput);
  bad = s.mesh;
  bad.F(0, 0) = bad.F(0, 1);
  EXPECT_THROW(make(bad), InvalidInput);
  bad = s.mesh;
  bad.F(0, 0) = 10000;
  EXPECT_THROW(make(bad), InvalidInput);
  EXPECT_THROW(pair_triangles(s.mesh.V, Faces(0, 3)), InvalidInput);
  std::vector<int> mirror = s.mirror;
  std::swap(mirror[0], mirror[1]);
  EXPECT_THROW(make(s.mesh, mirror), InvalidInput);
  mirror.pop_back();
  EXPECT_THROW(make(s.mesh, mirror), InvalidInput);
  EXPECT_THROW(FourEightMesh(s.mesh.V, s.mesh.F, {}, TrianglePairing{}), InvalidInput);
  FourEightMesh mesh = make(s.mesh);
  EXPECT_THROW(mesh.set_positions(s.mesh.V), InvalidInput);
  EXPECT_THROW(mesh.bisect(-1), InvalidInput);
}

}  // namespace
}  // namespace facewright
