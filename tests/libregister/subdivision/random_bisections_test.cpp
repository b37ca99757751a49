// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gtest/gtest.h>

#include "libmodel/core/random.h"
#include "libmodel/core/topology.h"
#include "libregister/reference/reference_face.h"
#include "tests/libregister/subdivision/conforming.h"
#include "tests/libregister/subdivision/shapes.h"

namespace facewright {
namespace {

constexpr int kBisections = 100000, kBetweenChecks = 1000;

// A T-vertex would leave the edge that it lies on with one triangle: the border would grow by more than was told.
void expect_conforming_throughout(const Mesh& base, const std::vector<int>& mirror) {
  FourEightMesh mesh(base.V, base.F, mirror, pair_triangles(base.V, base.F, mirror));
  const int euler = euler_characteristic(base.F);
  int border = boundary_edge_count(base.F);
  Random random(7);
  for (int i = 1; i <= kBisections; ++i) {
    const int t = random.index(mesh.face_count()), cost = mesh.cost(t);
    border += mesh.boundary_cost(t);
    ASSERT_EQ(mesh.bisect(t).vertices, cost);
    if (i % kBetweenChecks) continue;
    const Faces F = mesh.faces();
    const test::Conformity c = test::conformity(F, mesh.vertex_count());
    ASSERT_EQ(c.trouble, "") << i;
    ASSERT_EQ(c.boundary_edges, border) << i;
    ASSERT_EQ(c.euler, euler) << i;
    ASSERT_EQ(mesh.face_count(), 2 * mesh.vertex_count() - border - 2 * euler) << i;
    const std::vector<int>& image = mesh.mirror();
    for (size_t v = 0; v < image.size(); ++v) ASSERT_EQ(image[static_cast<size_t>(image[v])], static_cast<int>(v)) << i;
    // Triangle by triangle only now and then: it takes longer than all the rest.
    if (!mirror.empty() && i % (25 * kBetweenChecks) == 0) {
      ASSERT_NO_THROW(mirrored_triangles(F, image)) << i;
    }
  }
}

TEST(RandomBisections, TheReferenceStaysConformingAndItsMirrorAnInvolution) {
  const ReferenceFace face = default_reference_face();
  expect_conforming_throughout(face.mesh, face.mirror);
}

TEST(RandomBisections, AClosedSurfaceStaysConformingAndClosed) { expect_conforming_throughout(test::octahedron(), {}); }

TEST(RandomBisections, AnAsymmetricSheetWithAnOddBorderStaysConforming) {
  Mesh mesh = test::crooked_annulus(6, 7).mesh;
  mesh.F = Faces(mesh.F.topRows(mesh.F.rows() - 1));  // no vertex is lost
  ASSERT_EQ(boundary_edge_count(mesh.F) % 2, 1);
  expect_conforming_throughout(mesh, {});
}

}  // namespace
}  // namespace facewright
