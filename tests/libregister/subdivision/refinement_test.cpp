// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/subdivision/refinement.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libregister/reference/reference_face.h"
#include "tests/libregister/subdivision/conforming.h"
#include "tests/libregister/subdivision/shapes.h"

namespace facewright {
namespace {

FourEightMesh paired(const Mesh& m, const std::vector<int>& mirror = {}) {
  return {m.V, m.F, mirror, pair_triangles(m.V, m.F, mirror)};
}

TEST(RefineTo, HitsVerticesAndBoundaryEdgesTogether) {
  const auto s = test::crooked_annulus(8, 10);
  const int border = boundary_edge_count(s.mesh.F);
  for (const auto& mirror : {std::vector<int>{}, s.mirror})
    for (const int more : {0, 2, 20, 40, 78}) {
      FourEightMesh mesh = paired(s.mesh, mirror);
      refine_to(mesh, {5001, border + more});
      const auto c = test::conformity(mesh.faces(), mesh.vertex_count());
      EXPECT_EQ(c.trouble, "");
      EXPECT_EQ(mesh.vertex_count(), 5001);
      EXPECT_EQ(c.boundary_edges, border + more);
      EXPECT_EQ(mesh.face_count(), 2 * 5001 - border - more);
    }
}

TEST(RefineTo, OddNumbersOfBoundaryEdgesNeedNoSymmetry) {
  const auto s = test::crooked_annulus(8, 10);
  FourEightMesh mesh = paired(s.mesh);
  refine_to(mesh, {4000, boundary_edge_count(s.mesh.F) + 31});
  EXPECT_EQ(boundary_edge_count(mesh.faces()), boundary_edge_count(s.mesh.F) + 31);
}

TEST(RefineTo, RefusesBoundaryCountsThatCannotBe) {
  const auto s = test::annulus(6, 8);
  FourEightMesh mesh = paired(s.mesh, s.mirror);
  mesh.uniform_step();  // border edges across the midline are split now: the rest comes in pairs
  const int border = boundary_edge_count(mesh.faces()), vertices = mesh.vertex_count();
  FourEightMesh odd = mesh, fewer = mesh, many = mesh;
  EXPECT_THROW(refine_to(odd, {vertices + 600, border + 5}), InvalidInput);
  EXPECT_THROW(refine_to(fewer, {vertices + 600, border - 2}), InvalidInput);
  EXPECT_THROW(refine_to(many, {vertices + 200, border + 400}), InvalidInput);
  EXPECT_THROW(refine_to(mesh, vertices - 1), InvalidInput);
}

TEST(SurreyLevels, HaveTheTrianglesOfTheReleasedModelWithoutSymmetry) {
  const ReferenceFace face = default_reference_face();
  const MultiresTemplate t = build_hierarchy(face.mesh, {}, face.landmarks);
  EXPECT_EQ(t.levels[1].F.rows(), 6736);
  EXPECT_EQ(t.levels[2].vertex_count, 16759);
  EXPECT_EQ(t.levels[2].F.rows(), 33211);
  EXPECT_EQ(boundary_edge_count(t.levels[2].F), 307);
  EXPECT_EQ(t.levels[3].vertex_count, 29587);
  EXPECT_EQ(t.levels[3].F.rows(), 58763);
}

TEST(SurreyLevels, AreOneBoundaryEdgeOffWithSymmetry) {
  const MultiresTemplate t = default_reference();
  const std::vector<int> vertices = {845, 3448, 16759, 29587}, triangles = {1610, 6736, 33212, 58764},
                         border = {80, 160, 306, 410};
  for (size_t l = 0; l < 4; ++l) {
    const auto c = test::conformity(t.levels[l].F, t.levels[l].vertex_count);
    EXPECT_EQ(c.trouble, "");
    EXPECT_EQ(c.euler, 0);
    EXPECT_EQ(t.levels[l].vertex_count, vertices[l]);
    EXPECT_EQ(t.levels[l].F.rows(), triangles[l]);
    EXPECT_EQ(c.boundary_edges, border[l]);
  }
}

}  // namespace
}  // namespace facewright
