// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/global_mapping.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "libmodel/core/errors.h"
#include "tests/libregister/registration/bumpy_face.h"
#include "tests/support/matchers.h"

namespace facewright {
namespace {

Landmarks named(const Vertices& X) {
  Landmarks l;
  for (Eigen::Index i = 0; i < X.rows(); ++i) l[std::to_string(i + 1)].position = X.row(i);
  return l;
}

// Something with the extent of the 68 face landmarks.
Vertices cloud(std::uint64_t seed, Eigen::Index n = 40) {
  Random random(seed);
  Vertices X = random_points(random, n, 1);
  for (auto row : X.rowwise()) row = Eigen::RowVector3d(40 * row[0], 50 * row[1], 20 * row[2]);
  return X;
}

TEST(AlignLandmarks, RecoversAPlantedSimilarity) {
  Random random(1);
  for (int trial = 0; trial < 10; ++trial) {
    Similarity planted = random_similarity(random);
    planted.s = random.uniform(0.8, 1.3);
    const Vertices A = cloud(trial + 10);
    const AlignResult r = align_landmarks(named(A), named(planted.apply(A)));
    EXPECT_NEAR(r.scan_from_reference.s, planted.s, 1e-9);
    EXPECT_LT(r.rms, 1e-8);
  }
}

TEST(AlignLandmarks, NamesALandmarkThirtyMillimetresOff) {
  int found = 0;
  for (int trial = 0; trial < 100; ++trial) {
    Random random(1000 + trial);
    const Vertices A = cloud(77);
    Vertices B = A + random_points(random, A.rows(), 2);
    const int wrong = random.index(static_cast<int>(A.rows()));
    Eigen::RowVector3d d = random_points(random, 1, 1).row(0);
    B.row(wrong) += 30 * d.normalized();
    const AlignResult r = align_landmarks(named(A), named(B));
    found += r.rejected == std::vector<std::string>{std::to_string(wrong + 1)};
  }
  EXPECT_GE(found, 99);
}

TEST(AlignLandmarks, PutsSwappedSidesRight) {
  Random random(5);
  Landmarks reference;
  for (int i = 1; i <= 68; ++i) {  // a left-right symmetric set
    const std::string name = std::to_string(i), twin = mirrored_landmark(name);
    if (reference.count(twin) && twin != name) {
      reference[name].position = reference[twin].position.cwiseProduct(Eigen::Vector3d(-1, 1, 1));
    } else {
      reference[name].position = random_points(random, 1, 40).row(0).transpose();
      if (twin == name) reference[name].position[0] = 0;
    }
  }
  Landmarks swapped;
  for (const auto& [name, p] : reference) swapped[mirrored_landmark(name)] = p;
  const AlignResult r = align_landmarks(reference, swapped);
  EXPECT_TRUE(r.swapped_left_right);
  EXPECT_LT(r.rms, 1e-8);
  EXPECT_FALSE(align_landmarks(reference, reference).swapped_left_right);
}

TEST(AlignLandmarks, ExplainsWrongUnitsTooFewPointsAndNoFace) {
  const Vertices A = cloud(3);
  EXPECT_THROW(align_landmarks(named(A), named(0.1 * A)), InvalidInput);
  EXPECT_THROW(align_landmarks(named(A), named(A.topRows(2))), InvalidInput);
  EXPECT_THROW(align_landmarks(named(A), named(cloud(4))), InvalidInput);
}

TEST(GlobalMapping, CommutesWithRigidMotionOfTheScan) {
  const MultiresTemplate t = bumpy_template(21, 27);
  const Landmarks marks = locate(t.landmarks, t.V, t.levels[0].F);
  Landmarks target = locate(t.landmarks, warped(t.V), t.levels[0].F), moved;
  Random random(6);
  Similarity motion = random_similarity(random);
  motion.s = 1;
  for (const auto& [name, p] : target) moved[name].position = motion * p.position;
  EXPECT_THAT(global_mapping(t.V, nullptr, marks, moved).V,
              VerticesNear(motion.apply(global_mapping(t.V, nullptr, marks, target).V), 1e-7));
}

TEST(GlobalMapping, DropsALandmarkThatTheOthersContradict) {
  const MultiresTemplate t = bumpy_template(21, 27);
  const Landmarks marks = locate(t.landmarks, t.V, t.levels[0].F);
  Landmarks target = locate(t.landmarks, warped(t.V, 2), t.levels[0].F);
  target["p13"].position += Eigen::Vector3d(0, 11, 0);
  const GlobalMapResult r = global_mapping(t.V, nullptr, marks, target);
  std::vector<std::string> out = r.dropped;
  out.insert(out.end(), r.alignment.rejected.begin(), r.alignment.rejected.end());
  EXPECT_THAT(out, ::testing::ElementsAre("p13"));
}

TEST(GlobalMapping, WithFiveLandmarksStaysASimilarity) {
  const MultiresTemplate t = bumpy_template(21, 27);
  const Landmarks marks = locate(t.landmarks, t.V, t.levels[0].F);
  Landmarks five;
  for (const char* n : {"p1", "p5", "p13", "p21", "p25"}) five[n] = marks.at(n);
  const GlobalMapResult r = global_mapping(t.V, nullptr, marks, five);
  EXPECT_FALSE(r.used_spline);
  EXPECT_THAT(r.V, VerticesNear(t.V, 1e-8));
}

// Landmarks 1 .. 17 on a jaw-like arc, the rest of the 68 spread over a face-sized cloud.
Landmarks face_landmarks() {
  Landmarks l = named(cloud(9, 68));
  for (int i = 0; i < 17; ++i) {
    const double t = 3.14159 * i / 16;
    l[std::to_string(i + 1)].position = {60 * std::cos(t), -50 * std::sin(t), 0};
  }
  return l;
}

double residual_at(const std::string& name, const Landmarks& marks, const Landmarks& target, double slide) {
  GlobalMapOptions o;
  o.slide = slide;
  const Vertices x = marks.at(name).position.transpose();
  return (global_mapping(x, nullptr, marks, target, o).V.row(0).transpose() - target.at(name).position).norm();
}

TEST(GlobalMapping, LandmarksOfACurveYieldAlongItIfTheyMaySlide) {
  const Landmarks marks = face_landmarks();
  Landmarks along = marks, across = marks;  // landmark 5, inside the jaw's first half
  const Eigen::Vector3d tangent = (marks.at("6").position - marks.at("4").position).normalized();
  along["5"].position += 3 * tangent;
  across["5"].position += 3 * Eigen::Vector3d::UnitZ().cross(tangent);
  EXPECT_GT(residual_at("5", marks, along, 10), 1.2 * residual_at("5", marks, along, 1));
  EXPECT_GT(residual_at("5", marks, along, 10), 2.5);  // it hardly follows
  EXPECT_NEAR(residual_at("5", marks, across, 10), residual_at("5", marks, across, 1), 0.3);
}

TEST(GlobalMapping, EndsOfCurvesDoNotSlide) {
  const Landmarks marks = face_landmarks();
  Landmarks moved = marks;
  moved["9"].position += Eigen::Vector3d(3, 0, 0);  // the chin ends both halves of the jaw
  EXPECT_LT(residual_at("9", marks, moved, 10), residual_at("9", marks, moved, 1) + 0.01);  // neighbours give way
}

TEST(GlobalMapping, RefusesToSlideByLessThanOne) {
  const Landmarks marks = face_landmarks();
  EXPECT_THROW(residual_at("9", marks, marks, 0.5), InvalidInput);
}

}  // namespace
}  // namespace facewright
