// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/subdivision/deviation.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libregister/subdivision/hierarchy.h"
#include "tests/libregister/subdivision/shapes.h"

namespace facewright {
namespace {

// A sheet with a bump of height h at (x, y) and its mirror image, on the uniform mesh of five more steps.
struct Bumpy {
  test::SymmetricMesh sheet = test::annulus(6, 8);
  FourEightMesh start = tri_quad_mesh(sheet.mesh, sheet.mirror, budget());
  Vertices flat = uniform_hierarchy(sheet.mesh, sheet.mirror, {}, budget(), {2, 4}).V;

  int budget() {
    const auto pairing = pair_triangles(sheet.mesh.V, sheet.mesh.F, sheet.mirror);
    FourEightMesh mesh(sheet.mesh.V, sheet.mesh.F, sheet.mirror, pairing);
    mesh.uniform_step();
    return mesh.vertex_count();
  }
  Vertices bump(double x, double y, double h) const {
    Vertices V = flat;
    for (Eigen::Index v = 0; v < V.rows(); ++v)
      V(v, 2) += h * std::exp(-2 * (std::pow(std::abs(V(v, 0)) - x, 2) + std::pow(V(v, 1) - y, 2)));
    return V;
  }
};

TEST(MeasureDeviation, OfFlatFacesIsNothing) {
  const Bumpy b;
  for (const double d : measure_deviation(b.start, {b.flat}).deviations) ASSERT_NEAR(d, 0, 1e-20);
}

TEST(MeasureDeviation, GrowsWithTheSquareOfTheHeightAndAveragesOverFaces) {
  const Bumpy b;
  const auto one = measure_deviation(b.start, {b.bump(3, 4, 0.001)});
  const auto two = measure_deviation(b.start, {b.bump(3, 4, 0.002)});
  const auto mean = measure_deviation(b.start, {b.bump(3, 4, 0.001), b.flat});
  double largest = 0;
  for (size_t i = 0; i < one.deviations.size(); ++i) {
    largest = std::max(largest, one.deviations[i]);
    // The surfaces are nearly flat: areas and normals change by 1e-6 only.
    ASSERT_NEAR(two.deviations[i], 4 * one.deviations[i], 1e-4 * two.deviations[i] + 1e-18);
    ASSERT_NEAR(mean.deviations[i], 0.5 * one.deviations[i], 1e-4 * one.deviations[i] + 1e-18);
  }
  EXPECT_GT(largest, 0);
}

TEST(MeasureDeviation, DoesNotCareAboutPoseAndOrder) {
  const Bumpy b;
  const Eigen::Matrix3d R = Eigen::AngleAxisd(1.1, Eigen::Vector3d(3, 1, 2).normalized()).toRotationMatrix();
  const Vertices here = b.bump(3, 4, 0.5), other = b.bump(2, 6, 0.3);
  Vertices there = (here * R.transpose()).rowwise() + Eigen::RowVector3d(10, 20, -30);
  const auto x = measure_deviation(b.start, {here, other}), y = measure_deviation(b.start, {other, there});
  for (size_t i = 0; i < x.deviations.size(); ++i)
    ASSERT_NEAR(x.deviations[i], y.deviations[i], 1e-9 * x.deviations[i] + 1e-15);
}

// RMS distance along z between the uniform face and an adaptive hierarchy that interpolates it.
double deviation_of(const MultiresTemplate& t, const Bumpy& b, const Vertices& face) {
  const auto table = measure_deviation(b.start, {face});
  const Vertices V = on_hierarchy(table, face, t);
  const Faces& F = t.levels.back().F;
  double sum = 0;
  int count = 0;
  for (Eigen::Index i = 0; i < face.rows(); ++i)
    for (Eigen::Index f = 0; f < F.rows(); ++f) {  // heights over the plane: find the triangle that holds (x, y)
      const Eigen::RowVector2d p = face.row(i).head<2>(), a = V.row(F(f, 0)).head<2>();
      Eigen::Matrix2d M;
      M << V.row(F(f, 1)).head<2>() - a, V.row(F(f, 2)).head<2>() - a;
      const Eigen::RowVector2d w = (p - a) * M.inverse();
      if (w.minCoeff() < -1e-9 || w.sum() > 1 + 1e-9) continue;
      const double z = (1 - w.sum()) * V(F(f, 0), 2) + w[0] * V(F(f, 1), 2) + w[1] * V(F(f, 2), 2);
      sum += (z - face(i, 2)) * (z - face(i, 2));
      ++count;
      break;
    }
  return std::sqrt(sum / count);
}

TEST(DeviationCriterion, LeavesLessDeviationThanEdgeLengthOnFacesItHasNotSeen) {
  Bumpy b;
  const int first = b.budget();
  const auto build = [&](const RefinementCriterion& criterion) {
    HierarchyOptions options;
    options.criterion = criterion;
    return build_hierarchy(b.sheet.mesh, b.sheet.mirror, {}, {first, 2 * first}, options);
  };
  const auto table = measure_deviation(b.start, {b.bump(3, 4, 0.5), b.bump(3.1, 4.2, 0.7)});
  const Vertices unseen = b.bump(3.2, 4.1, 0.6);
  const double by_length = deviation_of(build(bent_length_criterion(0)), b, unseen);
  const double by_deviation = deviation_of(build(deviation_criterion(table)), b, unseen);
  EXPECT_LT(by_deviation, 0.8 * by_length);
}

TEST(DeviationCriterion, WithoutDeviationLongEdgesComeFirst) {
  Bumpy b;
  const int first = b.budget();
  HierarchyOptions options;
  options.criterion = deviation_criterion(measure_deviation(b.start, {b.flat}));
  const auto t = build_hierarchy(b.sheet.mesh, b.sheet.mirror, {}, {first, 3 * first}, options);
  double shortest = 1e9, longest = 0;
  const Faces& F = t.levels.back().F;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const double base = (t.V.row(F(f, 1)) - t.V.row(F(f, 2))).norm();  // apex first
    shortest = std::min(shortest, base);
    longest = std::max(longest, base);
  }
  EXPECT_LT(longest, 3 * shortest);
}

TEST(MeasureDeviation, GivesBothSidesTheMeanOfBothInAFaceThatIsNotSymmetric) {
  const Bumpy b;
  Vertices left = b.bump(3, 4, 0.001), right = left;
  for (Eigen::Index v = 0; v < left.rows(); ++v) (left(v, 0) < 0 ? right : left)(v, 2) = 0;
  const auto x = measure_deviation(b.start, {left}), y = measure_deviation(b.start, {right});
  double largest = 0;
  for (size_t i = 0; i < x.deviations.size(); ++i) {
    largest = std::max(largest, x.deviations[i]);
    ASSERT_NEAR(x.deviations[i], y.deviations[i], 1e-6 * x.deviations[i] + 1e-18);
  }
  EXPECT_GT(largest, 0);
}

TEST(OnHierarchy, TakesItsVerticesFromTheFaceAndFinerOnesFromTheirParents) {
  Bumpy b;
  const Vertices face = b.bump(3, 4, 0.5);
  const auto table = measure_deviation(b.start, {face});
  const auto finer = uniform_hierarchy(b.sheet.mesh, b.sheet.mirror, {}, b.budget(), {2, 5});
  const Vertices V = on_hierarchy(table, face, finer);
  ASSERT_GT(V.rows(), face.rows());
  EXPECT_EQ(Vertices(V.topRows(face.rows())), face);
  for (Eigen::Index v = face.rows(); v < V.rows(); ++v) {
    const VertexParents& p = finer.parents[static_cast<size_t>(v - finer.base_count())];
    ASSERT_EQ(V.row(v), Eigen::RowVector3d(0.5 * (V.row(p.a) + V.row(p.b))));
  }
  EXPECT_THROW(on_hierarchy(table, Vertices(face.topRows(face.rows() - 1)), finer), InvalidInput);
}

TEST(MeasureDeviation, RefusesFacesOfAnotherMesh) {
  const Bumpy b;
  EXPECT_THROW(measure_deviation(b.start, {}), InvalidInput);
  EXPECT_THROW(measure_deviation(b.start, {Vertices::Zero(b.flat.rows() - 1, 3)}), InvalidInput);
  EXPECT_THROW(measure_deviation(b.start, {b.flat, Vertices::Zero(3, 3)}), InvalidInput);
  EXPECT_THROW(deviation_criterion(measure_deviation(b.start, {b.flat}), {-1}), InvalidInput);
}

}  // namespace
}  // namespace facewright
