// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/synthetic/mean_head.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/core/topology.h"
#include "tests/libmodel/synthetic/shared_face.h"

namespace facewright {
namespace {

using Eigen::Vector3d;

TEST(MeanHead, DistanceIsExactlySymmetric) {
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d p{random.uniform(-90, 90), random.uniform(-140, 120), random.uniform(-140, 90)};
    EXPECT_EQ(mean_head_distance(p), mean_head_distance({-p.x(), p.y(), p.z()}));
  }
}

TEST(MeanHead, LandmarksLieOnTheSurfaceAndAreMirrored) {
  const Landmarks marks = mean_head_landmarks();
  for (int i = 1; i <= 68; ++i) EXPECT_TRUE(marks.contains(std::to_string(i))) << i;
  EXPECT_GE(marks.size(), 68U + 20U);
  for (const auto& [name, mark] : marks) {
    EXPECT_NEAR(mean_head_distance(mark.position), 0, 1e-6) << name;
    const auto other = marks.find(mirrored_landmark(name));
    ASSERT_NE(other, marks.end()) << name;
    EXPECT_EQ(other->second.position, Vector3d(-mark.position.x(), mark.position.y(), mark.position.z())) << name;
  }
}

TEST(MeanHead, IbugLandmarksFollowTheScheme) {
  const Landmarks marks = mean_head_landmarks();
  const auto at = [&](int i) { return marks.at(std::to_string(i)).position; };
  EXPECT_LT(at(1).x(), -60);  // the subject's right ear
  EXPECT_GT(at(17).x(), 60);
  for (int i = 2; i <= 17; ++i) EXPECT_GT(at(i).x(), at(i - 1).x()) << i;   // round the jaw from right to left
  for (int i = 1; i <= 8; ++i) EXPECT_LT(at(i + 1).y(), at(i).y()) << i;    // down to the chin
  for (int i = 29; i <= 31; ++i) EXPECT_LT(at(i).y(), at(i - 1).y()) << i;  // down the bridge
  EXPECT_LT(at(37).x(), at(40).x());
  EXPECT_GT(at(38).y(), at(42).y());
  EXPECT_GT(at(52).y(), at(63).y());
  EXPECT_GT(at(63).y(), at(67).y());
  EXPECT_GT(at(67).y(), at(58).y());
}

struct Norm {
  const char *from, *to;
  double low, high;
};

// Ranges: mean of young men and women, give or take the standard deviation, rounded outwards [farkas1994]. Our 28, 34,
// 32/36 and menton stand for nasion, subnasale, alar base and gnathion.
TEST(MeanHead, DistancesLieInPublishedRanges) {
  const Landmarks marks = mean_head_landmarks();
  const Norm norms[] = {
      {"40", "43", 29, 36},                            // en-en
      {"37", "46", 84, 95},                            // ex-ex
      {"right_alare", "left_alare", 29, 37},           // al-al
      {"49", "55", 47, 58},                            // ch-ch
      {"28", "34", 47, 58},                            // n-sn
      {"34", "menton", 60, 77},                        // sn-gn
      {"28", "menton", 106, 131},                      // n-gn
      {"right_zygion", "left_zygion", 125, 145},       // zy-zy
      {"right_gonion", "left_gonion", 89, 113},        // go-go
      {"31", "34", 17, 22},                            // prn-sn
      {"trichion", "28", 56, 75},                      // tr-n
      {"right_euryon", "left_euryon", 139, 157},       // eu-eu
      {"glabella", "opisthocranion", 180, 205},        // g-op
      {"right_tragion", "left_tragion", 125, 152},     // t-t
      {"left_superaurale", "left_subaurale", 53, 68},  // sa-sba
  };
  for (const Norm& n : norms) {
    const double d = (marks.at(n.from).position - marks.at(n.to).position).norm();
    EXPECT_GE(d, n.low) << n.from << " - " << n.to;
    EXPECT_LE(d, n.high) << n.from << " - " << n.to;
  }
}

TEST(CanonicalMesh, IsAManifoldDiscOnTheSurface) {
  const Mesh& mesh = shared_face().mean();
  EXPECT_NO_THROW(edges(mesh.F));
  EXPECT_EQ(connected_components(mesh.V.rows(), mesh.F).count, 1);
  EXPECT_EQ(euler_characteristic(mesh.F), 1);  // closed but for the neck
  // only in the crease between eyeball and lid, where the distance has a kink, may a vertex be a little off
  int off = 0;
  for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) {
    const double d = std::abs(mean_head_distance(row(mesh.V, v)));
    EXPECT_LT(d, 0.3);
    off += d > 1e-3;
  }
  EXPECT_LT(off, 20);
}

TEST(CanonicalMesh, IsMirroredVertexForVertex) {
  const Mesh& mesh = shared_face().mean();
  const std::vector<int>& mirror = shared_face().mirror();
  for (int v = 0; v < static_cast<int>(mesh.V.rows()); ++v) {
    const int m = mirror[static_cast<size_t>(v)];
    ASSERT_EQ(mirror[static_cast<size_t>(m)], v);
    ASSERT_EQ(row(mesh.V, m), Vector3d(-mesh.V(v, 0), mesh.V(v, 1), mesh.V(v, 2)));
  }
}

TEST(CanonicalMesh, IsTheSameForAnyNumberOfThreads) {
  const CanonicalMesh one = extract_mean_head({3, 6, 1}), many = extract_mean_head({3, 6, 3});
  EXPECT_EQ(one.mesh.V, many.mesh.V);
  EXPECT_EQ(one.mesh.F, many.mesh.F);
}

TEST(CanonicalMesh, FinerSpacingGivesMoreVertices) {
  EXPECT_GT(extract_mean_head({2.5, 6, 0}).mesh.V.rows(), extract_mean_head({4, 6, 0}).mesh.V.rows());
}

TEST(CanonicalMesh, RefusesSpacingsOutOfRange) {
  EXPECT_THROW(extract_mean_head({0.1, 4, 0}), InvalidInput);
  EXPECT_THROW(extract_mean_head({2, 1, 0}), InvalidInput);
}

}  // namespace
}  // namespace facewright
