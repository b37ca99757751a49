// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/scan_landmarks.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <set>

#include "libmodel/core/random.h"
#include "libmodel/geometry/normals.h"
#include "libregister/landmarking/coarse_pose.h"
#include "libregister/landmarking/geometric_median.h"
#include "libregister/landmarking/landmark_checks.h"
#include "libregister/landmarking/mirror_plane.h"
#include "libregister/landmarking/pose_sweep.h"
#include "libregister/landmarking/relief_pose.h"
#include "libregister/landmarking/thin_mesh.h"
#include "libregister/reference/reference_face.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

const MultiresTemplate& reference() {
  static const MultiresTemplate face = default_reference();
  return face;
}

Landmarks reference_marks() {
  const Mesh base = reference().level_mesh(0);
  return locate(reference().landmarks, base.V, base.F);
}

Similarity random_motion(Random& random) {
  return {1, random_rotation(random), 200 * Eigen::Vector3d(random.normal(), random.normal(), random.normal())};
}

Mesh moved(const Mesh& mesh, const Similarity& S) {
  Mesh result = mesh;
  result.V = S.apply(mesh.V);
  return result;
}

PoseTarget pose_target(const Mesh& mesh) {
  Mesh thin = thin_mesh(mesh, 3);
  Vertices normals = vertex_normals(thin.V, thin.F);
  return {std::move(thin), std::move(normals)};
}

TEST(GeometricMedian, IsTheMiddleOfASymmetricCloudAndHardlyFollowsOneOutlier) {
  std::vector<Eigen::Vector3d> points;
  for (int k = 0; k < 3; ++k)
    for (const double s : {-1.0, 1.0}) points.emplace_back(Eigen::Vector3d(5, 6, 7) + s * Eigen::Vector3d::Unit(k));
  EXPECT_LT((geometric_median(points) - Eigen::Vector3d(5, 6, 7)).norm(), 1e-5);
  points.emplace_back(1000, 0, 0);
  EXPECT_LT((geometric_median(points) - Eigen::Vector3d(5, 6, 7)).norm(), 0.5);  // the mean is 142 away
  EXPECT_EQ(geometric_median({Eigen::Vector3d(1, 2, 3)}), Eigen::Vector3d(1, 2, 3));
}

TEST(ThinMesh, IsOrientedHasFewerTrianglesAndLiesOnTheSurface) {
  const Mesh face = reference().level_mesh(3), thin = thin_mesh(face, 4);
  EXPECT_LT(thin.F.rows(), face.F.rows() / 2);
  std::set<std::pair<int, int>> sides;
  for (Eigen::Index f = 0; f < thin.F.rows(); ++f)
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(sides.emplace(thin.F(f, k), thin.F(f, (k + 1) % 3)).second);
  const PointIndex index(face.V);
  const std::vector<int> near = index.nearest(thin.V);
  for (Eigen::Index i = 0; i < thin.V.rows(); ++i)
    EXPECT_LT((thin.V.row(i) - face.V.row(near[static_cast<size_t>(i)])).norm(), 4);
  EXPECT_EQ(thin_mesh_to(face, face.F.rows()).V, face.V);
  EXPECT_LE(thin_mesh_to(face, 5000).F.rows(), 5000);
}

TEST(MirrorPlane, IsFoundFromTenDegreesAndTenMillimetresOff) {
  const PoseTarget target = pose_target(reference().level_mesh(2));
  std::vector<int> all;
  for (int i = 0; i < target.mesh.V.rows(); ++i) all.push_back(i);
  MirrorPlane guess;
  guess.normal = Eigen::Vector3d(1, 0.1, -0.12).normalized();
  guess.offset = 10;
  const MirrorPlane plane = refine_mirror_plane(guess, target.mesh.V, target.normals, target.index, all);
  EXPECT_GT(std::abs(plane.normal.x()), std::cos(0.01));
  EXPECT_LT(std::abs(plane.offset), 0.5);  // cells of 3 mm are not symmetric
}

TEST(CubeRotations, AreTheTwentyFourDifferentOnes) {
  const auto rotations = cube_rotations();
  ASSERT_EQ(rotations.size(), 24u);
  for (size_t i = 0; i < rotations.size(); ++i) {
    EXPECT_DOUBLE_EQ(rotations[i].determinant(), 1);
    for (size_t j = 0; j < i; ++j) EXPECT_GT((rotations[i] - rotations[j]).norm(), 1);
  }
}

TEST(CoarsePoses, FindAFaceInAnyOrientation) {
  const Mesh base = reference().level_mesh(0), fine = reference().level_mesh(1);
  const FacePattern pattern = face_pattern(fine, base, reference_marks().at("31").position);
  Random random(7);
  for (int draw = 0; draw < 6; ++draw) {
    const Similarity planted = random_motion(random);
    const auto poses = find_coarse_poses(pattern, pose_target(moved(reference().level_mesh(2), planted)));
    ASSERT_FALSE(poses.empty());
    EXPECT_GT(poses[0].score, 0.8);
    const Similarity off = poses[0].scan_from_head.inverse() * planted;
    EXPECT_LT(Eigen::AngleAxisd(off.R).angle(), 0.05);
    EXPECT_LT(off.t.norm(), 5);
  }
}

TEST(LandmarkAsymmetry, IsZeroOfASymmetricFaceWhereverItStandsAndGrowsWithADefect) {
  Random random(3);
  Landmarks marks = reference_marks();
  const Similarity S = random_motion(random);
  for (auto& [name, mark] : marks) mark.position = S * mark.position;
  EXPECT_LT(landmark_asymmetry(marks), 1e-3);  // the reference's text has four decimals
  marks.at("37").position += Eigen::Vector3d(20, 0, 0);
  EXPECT_GT(landmark_asymmetry(marks), 1);
}

TEST(ScanLandmarker, ByGeometryFindsTheReferencesOwnLandmarksInAnyOrientation) {
  ScanLandmarker landmarker(reference(), LandmarkMethod::geometry);
  EXPECT_FALSE(landmarker.uses_pictures());
  Random random(11);
  const Similarity planted = random_motion(random);
  const FindLandmarksResult found = landmarker.find(moved(reference().level_mesh(3), planted), {});
  ASSERT_TRUE(found.summary.found) << found.summary.reason;
  EXPECT_EQ(found.summary.method, "geometry");
  double squares = 0, n = 0;
  for (const auto& [name, mark] : reference_marks()) {
    if (is_jaw_landmark(name)) continue;
    squares += (found.landmarks.at(name).position - planted * mark.position).squaredNorm(), ++n;
    EXPECT_GT(found.landmarks.at(name).stddev, 0) << name;
  }
  EXPECT_LT(std::sqrt(squares / n), 1.5);  // relief is compared in pixels of a millimetre
}

TEST(ReliefPose, FindsAFaceThatLiesAFeatureHigher) {
  const Mesh face = reference().level_mesh(2);
  const Landmarks marks = reference_marks();
  FaceViewOptions view;
  view.centre = (marks.at("28").position + marks.at("58").position) / 2;
  Random random(5);
  const Similarity planted = random_motion(random);
  Similarity low = planted;
  low.t += planted.R * Eigen::Vector3d(3, -22, 0);  // its nose on the lips
  const Mesh scan = moved(face, planted);
  const ReliefPose found = lay_by_relief(scan, face, low, view);
  EXPECT_GT(found.likeness, 0.95);
  EXPECT_EQ(found.height, 1);
  EXPECT_LT((found.V - scan.V).rowwise().norm().mean(), 2);  // pixels of 2 mm
}

TEST(ReliefPose, WithoutASurfaceNothingIsAlike) {
  FaceViewOptions view;
  Similarity elsewhere;
  elsewhere.t = {5000, 0, 0};
  EXPECT_EQ(lay_by_relief(reference().level_mesh(2), reference().level_mesh(2), elsewhere, view).likeness, -1);
}

TEST(ScanLandmarker, OfTwoHeadsTheKnownPoseChooses) {
  ScanLandmarker landmarker(reference(), LandmarkMethod::geometry);
  const Mesh one = reference().level_mesh(3);
  const auto n = static_cast<int>(one.V.rows());
  const Eigen::RowVector3d apart(320, 40, 0);
  Mesh two;
  two.V.resize(2 * n, 3), two.F.resize(2 * one.F.rows(), 3);
  two.V << one.V, one.V.rowwise() + apart;
  two.F << one.F, (one.F.array() + n).matrix();
  for (const double k : {0.0, 1.0}) {
    FindLandmarksOptions options;
    options.scan_from_head =
        Similarity{1, Eigen::Matrix3d::Identity(), k * apart.transpose() + Eigen::Vector3d(8, 5, -5)};
    const FindLandmarksResult found = landmarker.find(two, {}, options);
    ASSERT_TRUE(found.summary.found) << found.summary.reason;
    const Eigen::Vector3d nose = reference_marks().at("31").position + k * apart.transpose();
    EXPECT_LT((found.landmarks.at("31").position - nose).norm(), 4) << k;
  }
}

TEST(ScanLandmarker, ABallHoldsNoFaceAndTheReasonIsTold) {
  ScanLandmarker landmarker(reference(), LandmarkMethod::geometry);
  const FindLandmarksResult found = landmarker.find(icosphere(5, 100), {});
  EXPECT_FALSE(found.summary.found);
  EXPECT_TRUE(found.landmarks.empty());
  EXPECT_FALSE(found.summary.reason.empty());
}

TEST(ScanLandmarker, ThreadsDoNotChangeABit) {
  ScanLandmarker landmarker(reference());
  const Mesh face = reference().level_mesh(3);
  const auto one = landmarker.find(face, {}, {.threads = 1}), four = landmarker.copy().find(face, {}, {.threads = 4});
  ASSERT_EQ(one.landmarks.size(), four.landmarks.size());
  for (const auto& [name, mark] : one.landmarks) EXPECT_EQ(mark.position, four.landmarks.at(name).position) << name;
}

TEST(LandmarkChecks, FewOrUnmatchedLandmarksAreRefused) {
  FindLandmarksSummary summary;
  summary.detected = 40;
  summary.matched = 0.9;
  EXPECT_EQ(landmark_failure(summary), "");
  summary.dropped.assign(15, "x");
  EXPECT_NE(landmark_failure(summary).find("25 landmarks"), std::string::npos);
  summary.dropped.clear();
  summary.matched = 0.3;
  EXPECT_NE(landmark_failure(summary).find("30 %"), std::string::npos);
}

}  // namespace
}  // namespace facewright
