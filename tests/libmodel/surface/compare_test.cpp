// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/surface/compare.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>

#include "libmodel/core/errors.h"
#include "tests/support/matchers.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

// A bumpy half ellipsoid without symmetry: one pose fits best.
Mesh bumpy_cap(int rings, int segments) {
  Mesh mesh = hemisphere(rings, segments, 1);
  for (auto x : mesh.V.rowwise()) {
    const double bump = 1 + 0.1 * std::sin(3 * x[0] + 1) * std::cos(2 * x[1]) + 0.08 * x[0] * x[1];
    x = Eigen::RowVector3d(75 * x[0], 95 * x[1], 85 * x[2] * bump);
  }
  return mesh;
}

Similarity small_motion(double scale) {
  Similarity T;
  T.s = scale;
  T.R = Eigen::AngleAxisd(0.15, Eigen::Vector3d(1, 2, 0.5).normalized()).toRotationMatrix();
  T.t << 4, -6, 3;
  return T;
}

Mesh moved(Mesh mesh, const Similarity& T) {
  mesh.V = T.apply(mesh.V);
  return mesh;
}

TEST(CompareSurfaces, ConcentricSpheresDifferByTheirRadii) {
  const CompareResult result =
      compare_surfaces(icosphere(3, 52), icosphere(5, 50), {.alignment = SurfaceAlignment::none});
  EXPECT_NEAR(result.summary.mean, 2, 0.02);  // facets of the inner sphere lie up to 0.02 mm inside it
  EXPECT_NEAR(result.summary.max, 2, 0.05);
  EXPECT_EQ(result.summary.compared, 642);
  EXPECT_THAT(result.target_from_source.R, MatrixNear(Eigen::Matrix3d::Identity(), 0.0));
}

TEST(CompareSurfaces, RecoversAPlantedRigidMotion) {
  const Mesh target = bumpy_cap(40, 120);
  const Similarity motion = small_motion(1);
  const CompareResult result = compare_surfaces(moved(bumpy_cap(20, 60), motion.inverse()), target);
  EXPECT_TRUE(result.summary.converged);
  EXPECT_THAT(result.target_from_source.R, MatrixNear(motion.R, 2e-3));
  EXPECT_EQ(result.target_from_source.s, 1);
  EXPECT_LT(result.summary.mean, 0.1);  // coarse vertices lie on the cap, the target's facets a little inside it
}

TEST(CompareSurfaces, SimilarityRecoversScaleAndRigidLeavesIt) {
  const Mesh target = bumpy_cap(40, 120);
  const Mesh source = moved(bumpy_cap(20, 60), small_motion(1.1).inverse());
  const CompareResult similar = compare_surfaces(source, target, {.alignment = SurfaceAlignment::similarity});
  EXPECT_NEAR(similar.target_from_source.s, 1.1, 2e-3);
  EXPECT_LT(similar.summary.mean, 0.1);
  EXPECT_GT(compare_surfaces(source, target).summary.mean, 10 * similar.summary.mean);
}

TEST(CompareSurfaces, TurningBothMeshesTogetherChangesNothing) {
  const Mesh a = bumpy_cap(16, 50), b = bumpy_cap(24, 70);
  Random random(5);
  Similarity T = random_similarity(random);
  T.s = 1;
  const CompareOptions options{.alignment = SurfaceAlignment::none};
  EXPECT_THAT(compare_surfaces(moved(a, T), moved(b, T), options).distances,
              MatrixNear(compare_surfaces(a, b, options).distances, 1e-9));  // rounding of coordinates near 300
}

TEST(CompareSurfaces, LeavesOutWhatLiesBeyondTheBorder) {
  Mesh wide = plane_grid(20, 20, 200, 200), narrow = plane_grid(10, 10, 100, 100);
  wide.V.col(2).array() += 1;
  const CompareResult result = compare_surfaces(wide, narrow, {.alignment = SurfaceAlignment::none});
  EXPECT_EQ(result.summary.compared, 9 * 9);  // strictly inside the narrow plane
  EXPECT_NEAR(result.summary.max, 1, 1e-12);
  EXPECT_EQ(result.distances.minCoeff(), -1);
}

TEST(CompareSurfaces, SpikesDoNotPullTheAlignment) {
  const Mesh target = bumpy_cap(40, 120);
  const Similarity motion = small_motion(1);
  Mesh source = bumpy_cap(20, 60);
  Random random(3);
  for (int i = 0; i < 40; ++i) source.V.row(random.index(static_cast<int>(source.V.rows()))) *= 1.4;
  const CompareResult result = compare_surfaces(moved(source, motion.inverse()), target);
  EXPECT_THAT(result.target_from_source.R, MatrixNear(motion.R, 4e-3));
  EXPECT_LT(result.summary.median, 0.1);
}

TEST(CompareSurfaces, SameResultForAnyNumberOfThreads) {
  const Mesh a = moved(bumpy_cap(16, 50), small_motion(1)), b = bumpy_cap(24, 70);
  EXPECT_THAT(compare_surfaces(a, b, {.threads = 1}).distances,
              SameBytes(compare_surfaces(a, b, {.threads = 4}).distances));
}

TEST(CompareSurfaces, RefusesMeshesThatCannotBeCompared) {
  const Mesh sphere = icosphere(1, 50);
  EXPECT_THROW(compare_surfaces(Mesh(), sphere), InvalidInput);
  EXPECT_THROW(compare_surfaces(sphere, Mesh()), InvalidInput);
  EXPECT_THROW(compare_surfaces(sphere, sphere, {.max_iterations = 0}), InvalidInput);
  Mesh far_plane = plane_grid(4, 4, 10, 10);
  far_plane.V.col(0).array() += 1000;
  EXPECT_THROW(compare_surfaces(far_plane, plane_grid(4, 4, 10, 10)), InvalidInput);
}

}  // namespace
}  // namespace facewright
