// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/core/topology.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>
#include <tuple>

#include "libmodel/core/errors.h"
#include "libmodel/core/landmarks.h"
#include "libmodel/core/multires_template.h"
#include "libmodel/core/parallel.h"
#include "tests/support/matchers.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

TEST(Topology, EulerCharacteristicOfKnownSurfaces) {
  EXPECT_EQ(euler_characteristic(icosphere(2, 1).F), 2);
  EXPECT_EQ(euler_characteristic(plane_grid(5, 4, 1, 1).F), 1);
  EXPECT_EQ(euler_characteristic(annulus(3, 12, 1, 2).F), 0);
}

TEST(Topology, TrianglesFollowFromVerticesAndBoundary) {
  // F = 2V - B - 2 chi for every triangulated surface with boundary.
  for (const Mesh& m : {icosphere(1, 1), plane_grid(6, 3, 1, 1), annulus(2, 9, 1, 2)})
    EXPECT_EQ(m.F.rows(), 2 * m.V.rows() - boundary_edge_count(m.F) - 2 * euler_characteristic(m.F));
}

TEST(Topology, AnnulusHasTwoLoopsTheLongerFirst) {
  Mesh m = annulus(3, 12, 1, 2);
  const auto loops = boundary_loops(m.F);
  ASSERT_EQ(loops.size(), 2u);
  EXPECT_EQ(loops[0].size() + loops[1].size(), static_cast<size_t>(boundary_edge_count(m.F)));
}

TEST(Topology, NeighboursAreMutual) {
  const Mesh m = icosphere(2, 1);
  const Adjacency ring = vertex_neighbours(m.V.rows(), m.F);
  for (int i = 0; i < ring.size(); ++i)
    for (const int* j = ring.begin(i); j != ring.end(i); ++j)
      EXPECT_TRUE(std::binary_search(ring.begin(*j), ring.end(*j), i));
}

TEST(Topology, RowsAreSortedSetsOnATangleOfTriangles) {
  Random random(3);
  const int n = 40;
  Faces F(150, 3);  // edges with any number of triangles, corners that coincide
  for (auto& index : F.reshaped()) index = random.index(n);
  const Adjacency ring = vertex_neighbours(n + 2, F), incident = vertex_faces(n + 2, F);
  for (int i = 0; i < n + 2; ++i) {
    std::set<int> neighbours, triangles;
    for (int f = 0; f < F.rows(); ++f)
      for (int k = 0; k < 3; ++k)
        if (F(f, k) == i) neighbours.insert({F(f, (k + 1) % 3), F(f, (k + 2) % 3)}), triangles.insert(f);
    EXPECT_THAT(std::vector<int>(ring.begin(i), ring.end(i)), testing::ElementsAreArray(neighbours));
    EXPECT_THAT(std::vector<int>(incident.begin(i), incident.end(i)), testing::ElementsAreArray(triangles));
  }
}

TEST(Topology, EdgesComeInOrderWithTheirTriangles) {
  const Mesh m = annulus(4, 15, 1, 2);
  const std::vector<Edge> list = edges(m.F);
  EXPECT_TRUE(std::is_sorted(list.begin(), list.end(),
                             [](const Edge& a, const Edge& b) { return std::tie(a.v0, a.v1) < std::tie(b.v0, b.v1); }));
  for (const Edge& e : list)
    for (const int f : {e.f0, e.f1})
      if (f >= 0) {
        EXPECT_TRUE((m.F.row(f).array() == e.v0).any() && (m.F.row(f).array() == e.v1).any());
      }
  EXPECT_TRUE(edges(Faces()).empty());
  EXPECT_THROW(edges(Faces::Constant(1, 3, -1)), InvalidInput);
}

TEST(Topology, ThreeTrianglesOnAnEdgeAreRefused) {
  Faces F(3, 3);
  F << 0, 1, 2, 1, 0, 3, 0, 1, 4;
  EXPECT_THROW(edges(F), InvalidInput);
}

TEST(Topology, SeparatePiecesAreSeparateComponents) {
  Faces F(2, 3);
  F << 0, 1, 2, 3, 4, 5;
  EXPECT_EQ(connected_components(6, F).count, 2);
}

TEST(Landmarks, OrderIsThePeoplesOrder) {
  Landmarks l;
  for (const char* name : {"10", "2", "menton", "1"}) l[name];
  std::vector<std::string> names;
  for (const auto& e : l) names.push_back(e.first);
  EXPECT_EQ(names, (std::vector<std::string>{"1", "2", "10", "menton"}));
}

TEST(Landmarks, MirroringTwiceIsNothing) {
  for (int i = 1; i <= 68; ++i) EXPECT_EQ(mirrored_landmark(mirrored_landmark(std::to_string(i))), std::to_string(i));
  EXPECT_EQ(mirrored_landmark("37"), "46");
  EXPECT_EQ(mirrored_landmark("left_gonion"), "right_gonion");
  EXPECT_EQ(mirrored_landmark("menton"), "menton");
}

TEST(RefineField, CarriesLinearFieldsExactlyAndKeepsTheCoarseRows) {
  const std::vector<VertexParents> parents = {{0, 1, -1}, {0, 1, 2}, {3, 4, -1}};
  Eigen::MatrixXd coarse(3, 2);
  coarse << 0, 0, 6, 0, 0, 6;
  const Eigen::MatrixXd fine = refine_field(parents, 3, coarse, 6);
  EXPECT_THAT(fine.topRows(3), SameBytes(coarse));
  EXPECT_THAT(fine.row(3), MatrixNear(Eigen::MatrixXd(Eigen::RowVector2d(3, 0)), 1e-15));
  EXPECT_THAT(fine.row(4), MatrixNear(Eigen::MatrixXd(Eigen::RowVector2d(2, 2)), 1e-15));
  EXPECT_THROW(refine_field(parents, 3, coarse, 7), InvalidInput);
}

TEST(ParallelFor, VisitsEveryIndexOnceAndRethrows) {
  std::vector<int> seen(1000, 0);
  parallel_for(1000, 4, [&](int i) { ++seen[static_cast<size_t>(i)]; });
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), 1000);
  EXPECT_THROW(parallel_for(100, 4,
                            [](int i) {
                              if (i == 50) throw InvalidInput("x");
                            }),
               InvalidInput);
}

TEST(ValidateMesh, RefusesBadIndicesAndPositions) {
  Mesh m = plane_grid(3, 3, 1, 1);
  EXPECT_NO_THROW(validate(m));
  m.F(0, 0) = 99;
  EXPECT_THROW(validate(m), InvalidInput);
  m = plane_grid(3, 3, 1, 1);
  m.V(0, 0) = std::nan("");
  EXPECT_THROW(validate(m), InvalidInput);
}

}  // namespace
}  // namespace facewright
