// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/reference/reference_face.h"

#include <gmock/gmock.h>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "tests/libregister/subdivision/shapes.h"

namespace facewright {
namespace {

TEST(FindMirror, FindsThePlantedTableWhateverTheOrderAndANoiseBelowTheTolerance) {
  auto s = test::annulus(5, 7, 2.0);
  EXPECT_EQ(find_mirror(s.mesh), s.mirror);
  s.mesh.V(3, 2) += 0.004;
  EXPECT_EQ(find_mirror(s.mesh), s.mirror);
}

TEST(FindMirror, GivesNothingForAnAsymmetricMesh) {
  auto s = test::annulus(5, 7);
  auto moved = s.mesh;
  moved.V(0, 1) += 0.1;
  EXPECT_TRUE(find_mirror(moved).empty());
  auto other_triangles = s.mesh;  // symmetric positions, but one diagonal turned on one side only
  const int a = other_triangles.F(0, 0), b = other_triangles.F(0, 1), d = other_triangles.F(0, 2);
  const int c = other_triangles.F(1, 1);
  other_triangles.F.row(0) << a, b, c;
  other_triangles.F.row(1) << a, c, d;
  EXPECT_TRUE(find_mirror(other_triangles).empty());
  EXPECT_THROW(find_mirror(s.mesh, 0), InvalidInput);
}

TEST(ReferenceText, RoundTripKeepsEverything) {
  const ReferenceFace face = default_reference_face();
  const ReferenceFace again = parse_reference(format_reference(face), "text");
  EXPECT_TRUE(again.mesh.V == face.mesh.V);
  EXPECT_TRUE(again.mesh.F == face.mesh.F);
  EXPECT_EQ(again.mirror, face.mirror);
  EXPECT_EQ(again.regions, face.regions);
  ASSERT_EQ(again.landmarks.size(), face.landmarks.size());
  for (const auto& [name, mark] : face.landmarks) EXPECT_EQ(again.landmarks.at(name).vertex, mark.vertex);
}

TEST(ReferenceText, MalformedTextNamesTheLine) {
  const std::string head = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const auto line_of = [&](const std::string& tail) {
    try {
      parse_reference(head + tail, "x");
    } catch (const IoError& e) {
      return e.line();
    }
    return -1;
  };
  EXPECT_EQ(line_of("f 0 1 2\n"), -1);
  EXPECT_EQ(line_of("f 0 1 3\n"), 4);
  EXPECT_EQ(line_of("f 0 1\n"), 4);
  EXPECT_EQ(line_of("f 0 1 2\nl 31 7\n"), 5);
  EXPECT_EQ(line_of("f 0 1 2\nr lips 0 x\n"), 5);
  EXPECT_EQ(line_of("q 1\n"), 4);
  EXPECT_EQ(line_of("v 1 2\n"), 4);
  EXPECT_GT(line_of(""), 0);
}

TEST(ReferenceFromMesh, MarksLandmarksAndHitsTheBudgets) {
  const ReferenceFace face = default_reference_face();
  Landmarks points = locate(face.landmarks, face.mesh.V, face.mesh.F);
  const Eigen::Vector3d inside_a_triangle =
      (face.mesh.V.row(face.mesh.F(100, 0)) + face.mesh.V.row(face.mesh.F(100, 1)) +
       face.mesh.V.row(face.mesh.F(100, 2))) /
      3;
  points["patch"].position = inside_a_triangle;
  const auto t = reference_from_mesh(face.mesh, points, {3448, 5001});
  EXPECT_EQ(t.levels.back().vertex_count, 5001);
  EXPECT_EQ(t.mirror.size(), 5001u);
  for (const auto& [name, mark] : face.landmarks) EXPECT_EQ(t.landmarks.at(name).vertex, mark.vertex) << name;
  EXPECT_EQ(t.landmarks.at("patch").vertex, -1);
  EXPECT_NEAR((position(t.landmarks.at("patch").point, t.V, t.levels[0].F) - inside_a_triangle).norm(), 0, 1e-9);
  EXPECT_EQ(t.regions.count("rim"), 1u);
}

TEST(ReferenceFromMesh, TakesAnAsymmetricMeshWithoutAMirrorTable) {
  auto mesh = default_reference_face().mesh;
  mesh.V.row(10) += Eigen::RowVector3d(0.5, 0, 0);
  const auto t = reference_from_mesh(mesh, {}, {3448, 16759});
  EXPECT_TRUE(t.mirror.empty());
  EXPECT_EQ(t.levels[2].vertex_count, 16759);
  EXPECT_EQ(t.levels[2].F.rows(), 2 * 16759 - boundary_edge_count(t.levels[2].F));
}

TEST(ReferenceFromMesh, RefusesLandmarksOfAnotherUnit) {
  const ReferenceFace face = default_reference_face();
  Landmarks points = locate(face.landmarks, face.mesh.V, face.mesh.F);
  for (auto& [name, mark] : points) mark.position *= 10;
  EXPECT_THROW(reference_from_mesh(face.mesh, points), InvalidInput);
}

}  // namespace
}  // namespace facewright
