// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/frame_detection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "tests/libregister/intake/frame_fixture.h"
#include "tests/support/matchers.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

struct Transformed {
  Mesh mesh;
  Landmarks landmarks;
};

Transformed transformed(const Eigen::Matrix3d& A, bool texture = true) {
  const SyntheticScan& scan = FrameFixture::get().person;
  Transformed t{scan.mesh, scan.true_landmarks};
  t.mesh.V = (t.mesh.V * A.transpose()).eval();
  for (auto& entry : t.landmarks) entry.second.position = A * entry.second.position;
  if (!texture) t.mesh.uv = TexCoords(), t.mesh.uv_faces = Faces();
  return t;
}

FrameDetection detect(const Mesh& mesh, const FrameOptions& options = {}) {
  return detect_frame(mesh, FrameFixture::get().reference, options);
}

Eigen::Matrix3d axes(FileAxis up, FileAxis front) {
  Eigen::Matrix3d Q;
  Q.col(1) = file_axis_vector(up), Q.col(2) = file_axis_vector(front), Q.col(0) = Q.col(1).cross(Q.col(2));
  return Q;
}

TEST(DetectFrame, UnitsAndAxesAreFoundAndExplained) {
  using enum FileAxis;
  const std::tuple<double, FileAxis, FileAxis, const char*> cases[] = {
      {1, plus_y, plus_z, "millimetres, y up, facing z: outer eye distance"},
      {1000, plus_z, minus_y, "metres, z up, facing -y: outer eye distance 0."},
      {10, minus_x, plus_y, "centimetres, -x up, facing y"},
      {25.4, minus_y, minus_z, "inches, -y up, facing -z"}};
  for (const auto& [mm, up, front, words] : cases) {
    Transformed t = transformed(axes(up, front) / mm);
    const FrameDetection d = detect(t.mesh);
    ASSERT_TRUE(d.summary.decided) << d.summary.problem;
    EXPECT_EQ(d.mm_per_unit, mm);
    EXPECT_THAT(d.summary.explanation, ::testing::StartsWith(words));
    EXPECT_FALSE(d.mirrored || d.flip_triangles);
    convert_to_head_axes(d, &t.mesh, &t.landmarks);
    EXPECT_TRUE(is_upright(t.landmarks));
  }
}

TEST(DetectFrame, ATextureTellsMirroredAxesFromTrianglesTurnedOver) {
  const Eigen::Matrix3d mirror = Eigen::Vector3d(1, 1, -1).asDiagonal();
  Transformed t = transformed(mirror);
  const FrameDetection mirrored = detect(t.mesh);
  ASSERT_TRUE(mirrored.summary.decided) << mirrored.summary.problem;
  EXPECT_TRUE(mirrored.mirrored);
  EXPECT_FALSE(mirrored.flip_triangles);
  EXPECT_THAT(mirrored.summary.explanation, ::testing::HasSubstr("mirrored"));
  convert_to_head_axes(mirrored, &t.mesh, &t.landmarks);
  EXPECT_TRUE(is_upright(t.landmarks));

  Transformed turned = transformed(Eigen::Matrix3d::Identity());
  const Faces good = turned.mesh.F;
  turned.mesh.F.col(1).swap(turned.mesh.F.col(2));
  if (turned.mesh.uv_faces.rows() > 0) turned.mesh.uv_faces.col(1).swap(turned.mesh.uv_faces.col(2));
  const FrameDetection d = detect(turned.mesh);
  ASSERT_TRUE(d.summary.decided) << d.summary.problem;
  EXPECT_FALSE(d.mirrored);
  convert_to_head_axes(d, &turned.mesh);
  EXPECT_THAT(turned.mesh.F, SameBytes(good));
}

TEST(DetectFrame, WithoutATextureTrianglesThatShowInwardAreAnErrorWithBothCauses) {
  const Eigen::Matrix3d mirror = Eigen::Vector3d(-1, 1, 1).asDiagonal();
  Transformed t = transformed(mirror, /*texture=*/false);
  const FrameDetection d = detect(t.mesh);
  EXPECT_FALSE(d.summary.decided);
  EXPECT_THAT(d.summary.problem, ::testing::AllOf(::testing::HasSubstr("turned over"),
                                                  ::testing::HasSubstr("left-handed"), ::testing::HasSubstr("y up")));
  EXPECT_THROW(require_decided(d), InvalidInput);
  FrameOptions left;
  left.handedness = Handedness::left;
  const FrameDetection told = detect(t.mesh, left);
  ASSERT_TRUE(told.summary.decided) << told.summary.problem;
  convert_to_head_axes(told, &t.mesh, &t.landmarks);
  EXPECT_TRUE(is_upright(t.landmarks));
  EXPECT_EQ(handedness_by_landmarks(transformed(mirror).landmarks, FrameFixture::get().reference), Handedness::left);
  EXPECT_EQ(handedness_by_landmarks(transformed(Eigen::Matrix3d::Identity()).landmarks, FrameFixture::get().reference),
            Handedness::right);
}

TEST(DetectFrame, HeadsThatLeanAreFoundAndTheirPoseIsNearTheTruth) {
  for (std::uint64_t i = 1; i <= 3; ++i) {
    Random random(i);
    const Eigen::Matrix3d lean =
        Eigen::AngleAxisd(random.uniform(0.3, 0.52), random_points(random, 1, 1).row(0).transpose().normalized())
            .toRotationMatrix();
    const Transformed t = transformed(lean);
    const FrameDetection d = detect(t.mesh);
    ASSERT_TRUE(d.summary.decided) << d.summary.problem;
    // The coarse fit of another person's face: some 10 degrees between their frames.
    const Eigen::Matrix3d truth = (lean * FrameFixture::get().person.scanner_from_head.R).transpose();
    EXPECT_LT(Eigen::AngleAxisd(d.head_from_file.R * truth.transpose()).angle(), 0.3);
    EXPECT_NEAR((d.head_from_file * t.landmarks.at("31").position)[0], 0, 10);
  }
}

TEST(DetectFrame, OverridesNarrowTheSearch) {
  const Transformed t = transformed(Eigen::Matrix3d::Identity());
  FrameOptions wrong;
  wrong.up = FileAxis::minus_y;
  const FrameDetection d = detect(t.mesh, wrong);
  EXPECT_TRUE(!d.summary.decided || d.summary.candidates.front().up == FileAxis::minus_y);
  EXPECT_THAT(d.summary.problem + ::testing::PrintToString(d.summary.warnings),
              ::testing::AllOf(::testing::HasSubstr("--up"), ::testing::HasSubstr("y up, facing z")));
  FrameOptions right;
  right.up = FileAxis::plus_y, right.front = FileAxis::plus_z, right.mm_per_unit = 1;
  const FrameDetection told = detect(t.mesh, right);
  EXPECT_TRUE(told.summary.decided);
  EXPECT_THAT(told.summary.warnings, ::testing::Not(::testing::Contains(::testing::HasSubstr("--up"))));
}

TEST(DetectFrame, AWrongUpIsObeyedAndWarnedOf) {
  const Transformed t = transformed(Eigen::Matrix3d::Identity());
  FrameOptions wrong;
  wrong.up = FileAxis::minus_y;
  wrong.highest_cost = 20, wrong.least_margin = 0.001;  // else no face is seen upside down, which is an error
  const FrameDetection d = detect(t.mesh, wrong);
  ASSERT_TRUE(d.summary.decided) << d.summary.problem;
  EXPECT_EQ(d.summary.candidates.front().up, FileAxis::minus_y);
  EXPECT_THAT(d.summary.warnings, ::testing::Contains(::testing::AllOf(::testing::HasSubstr("--up"),
                                                                       ::testing::HasSubstr("y up, facing z"))));
}

TEST(DetectFrame, TheSameForAnyNumberOfThreads) {
  const Transformed t = transformed(Eigen::Matrix3d::Identity());
  FrameOptions one, four;
  one.threads = 1, four.threads = 4;
  const FrameDetection a = detect(t.mesh, one), b = detect(t.mesh, four);
  EXPECT_EQ(a.head_from_file.R, b.head_from_file.R);
  EXPECT_EQ(a.head_from_file.t, b.head_from_file.t);
  EXPECT_EQ(a.summary.candidates.front().cost, b.summary.candidates.front().cost);
}

TEST(DetectFrame, ThingsThatAreNoFaceAreNotCalledOne) {
  for (const Mesh& thing : {icosphere(4, 100), plane_grid(40, 40, 250, 250), hemisphere(30, 60, 120),
                            cylinder_patch(40, 40, 90, std::numbers::pi / 2, 250)}) {
    const FrameDetection d = detect(thing);
    EXPECT_FALSE(d.summary.decided) << d.summary.explanation << " cost " << d.summary.candidates.front().cost;
    EXPECT_FALSE(d.summary.problem.empty());
  }
  EXPECT_THROW(detect(Mesh{}), InvalidInput);
}

TEST(FileAxes, NamesReadBackAndTheNearestRotationOfAnAxisRotationIsItself) {
  for (const char* name : {"x", "-x", "y", "-y", "z", "-z"}) EXPECT_EQ(file_axis_name(file_axis_from_name(name)), name);
  EXPECT_EQ(file_axis_from_name("+z"), FileAxis::plus_z);
  EXPECT_EQ(file_axis_from_name("auto"), FileAxis::automatic);
  for (const char* name : {"", "w", "--x", "xy"}) EXPECT_THROW(file_axis_from_name(name), InvalidInput);
  const Eigen::Matrix3d Q = axes(FileAxis::minus_z, FileAxis::plus_x);
  EXPECT_EQ(nearest_axis_rotation(Q * Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized())), Q);
}

}  // namespace
}  // namespace facewright
