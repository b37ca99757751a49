// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gtest/gtest.h>

#include <numbers>

#include "libmodel/geometry/folds.h"
#include "libmodel/geometry/laplacian.h"
#include "libmodel/geometry/normals.h"
#include "tests/support/matchers.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

TEST(Normals, SphereNormalsPointAwayFromTheCentre) {
  const Mesh m = icosphere(4, 50);
  const Vertices N = vertex_normals(m.V, m.F);
  EXPECT_GT((N.cwiseProduct(m.V / 50)).rowwise().sum().minCoeff(), 0.999);
}

TEST(Normals, VertexAreasAddUpToTheSurface) {
  const Mesh m = icosphere(4, 10);
  const double sphere = 4 * std::numbers::pi * 100;
  EXPECT_NEAR(vertex_areas(m.V, m.F).sum(), face_areas(m.V, m.F).sum(), 1e-9);
  EXPECT_NEAR(vertex_areas(m.V, m.F).sum(), sphere, 0.01 * sphere);  // inscribed polyhedron, 2562 vertices
}

TEST(CotangentStiffness, LinearFieldsAreHarmonicInsideAFlatMesh) {
  const Mesh m = plane_grid(9, 7, 20, 10);
  const Eigen::VectorXd f = m.V * Eigen::Vector3d(2, -3, 1);
  const Eigen::VectorXd Lf = cotangent_stiffness(m.V, m.F, {0, 10}) * f;
  const auto border = boundary_vertices(m.V.rows(), m.F);
  for (Eigen::Index i = 0; i < Lf.size(); ++i)
    if (!border[static_cast<size_t>(i)]) {
      EXPECT_NEAR(Lf[i], 0, 1e-10);
    }
}

TEST(CotangentStiffness, RowsSumToZeroAndItIsSymmetric) {
  const Mesh m = icosphere(2, 3);
  const Eigen::SparseMatrix<double> L = cotangent_stiffness(m.V, m.F);
  EXPECT_NEAR((L * Eigen::VectorXd::Ones(m.V.rows())).cwiseAbs().maxCoeff(), 0, 1e-12);
  EXPECT_NEAR((Eigen::MatrixXd(L) - Eigen::MatrixXd(L).transpose()).cwiseAbs().maxCoeff(), 0, 1e-14);
}

TEST(FoldedEdges, FlatMeshHasNoneAndAnOverturnedVertexIsFound) {
  Mesh m = plane_grid(5, 5, 4, 4);
  const auto edge_list = edges(m.F);
  EXPECT_TRUE(folded_edges(m.V, m.F, edge_list).empty());
  m.V.row(12).head<2>() += Eigen::RowVector2d(1.7, 0.2);  // the centre, moved across its neighbour
  EXPECT_FALSE(folded_edges(m.V, m.F, edge_list).empty());
}

}  // namespace
}  // namespace facewright
