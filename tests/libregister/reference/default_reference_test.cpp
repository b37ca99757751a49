// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <set>

#include "libmodel/core/topology.h"
#include "libmodel/synthetic/mean_head.h"
#include "libregister/reference/reference_face.h"

namespace facewright {
namespace {

constexpr double degree = M_PI / 180;

const MultiresTemplate& reference() {
  static const MultiresTemplate t = default_reference();
  return t;
}

Eigen::Vector3d face_normal(const Vertices& V, const Faces& F, int f) {
  const Eigen::Vector3d a = V.row(F(f, 1)) - V.row(F(f, 0)), b = V.row(F(f, 2)) - V.row(F(f, 0));
  return a.cross(b).normalized();
}

double smallest_angle(const Vertices& V, const Faces& F, int f) {
  double smallest = M_PI;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d a = V.row(F(f, (k + 1) % 3)) - V.row(F(f, k)), b = V.row(F(f, (k + 2) % 3)) - V.row(F(f, k));
    smallest = std::min(smallest, std::atan2(a.cross(b).norm(), a.dot(b)));
  }
  return smallest;
}

TEST(DefaultReference, HasTheCountsOfThePublishedFaceAtEveryLevel) {
  const auto& t = reference();
  ASSERT_EQ(t.levels.size(), 4u);
  const int vertices[] = {845, 3448, 16759, 29587};
  for (size_t l = 0; l < 4; ++l) {
    const Faces& F = t.levels[l].F;
    EXPECT_EQ(t.levels[l].vertex_count, vertices[l]);
    EXPECT_EQ(F.maxCoeff() + 1, vertices[l]);
    EXPECT_EQ(F.rows(), 2 * vertices[l] - boundary_edge_count(F));  // Euler characteristic 0
    EXPECT_EQ(euler_characteristic(F), 0);
    EXPECT_EQ(connected_components(vertices[l], F).count, 1);
    EXPECT_EQ(boundary_loops(F).size(), 2u);
  }
  EXPECT_EQ(t.levels[0].F.rows(), 1610);
  EXPECT_EQ(boundary_edge_count(t.levels[0].F), 80);
  EXPECT_EQ(t.levels[1].F.rows(), 6736);
  EXPECT_EQ(boundary_edge_count(t.levels[1].F), 160);
  EXPECT_THAT(t.levels[2].F.rows(), testing::AllOf(testing::Ge(33100), testing::Le(33400)));
}

TEST(DefaultReference, HasOneOuterBorderAndAClosedMouthSlit) {
  const auto loops = boundary_loops(reference().levels[0].F);
  ASSERT_EQ(loops.size(), 2u);
  EXPECT_EQ(loops[0].size(), 56u);
  ASSERT_EQ(loops[1].size(), 24u);
  // Upper and lower margin are different vertices, at most a millimetre and a half apart.
  const auto& t = reference();
  const auto middle = [&](const char* name) { return t.landmarks.at(name).vertex; };
  for (const auto& [upper, lower] : {std::pair("63", "67"), std::pair("62", "68"), std::pair("64", "66")}) {
    EXPECT_NE(middle(upper), middle(lower));
    EXPECT_LT((t.V.row(middle(upper)) - t.V.row(middle(lower))).norm(), 1.5);
    EXPECT_GT(t.V(middle(upper), 1), t.V(middle(lower), 1));
  }
}

TEST(DefaultReference, IsSymmetricVertexForVertexAtEveryLevel) {
  const auto& t = reference();
  ASSERT_EQ(t.mirror.size(), 29587u);
  for (int v = 0; v < t.V.rows(); ++v) {
    const int image = t.mirror[v];
    ASSERT_EQ(t.mirror[image], v);
    ASSERT_NEAR(t.V(image, 0), -t.V(v, 0), 1e-12);
    ASSERT_NEAR((t.V.row(image) - t.V.row(v)).tail<2>().norm(), 0, 1e-12);
  }
  for (const TemplateLevel& level : t.levels) {
    const std::vector<int> mirror(t.mirror.begin(), t.mirror.begin() + level.vertex_count);
    EXPECT_NO_THROW(mirrored_triangles(level.F, mirror));
    EXPECT_EQ(boundary_edge_count(level.F) % 2, 0);
  }
}

TEST(DefaultReference, MarksTheIbugPointsAndAtLeastTwelveMoreAllAtVertices) {
  const auto& t = reference();
  EXPECT_GE(t.landmarks.size(), 80u);
  for (int i = 1; i <= 68; ++i) EXPECT_TRUE(t.landmarks.count(std::to_string(i))) << i;
  for (const char* name : {"trichion", "glabella", "pogonion", "menton", "left_gonion", "left_zygion", "left_cheek"})
    EXPECT_TRUE(t.landmarks.count(name)) << name;
  std::set<int> vertices;
  for (const auto& [name, mark] : t.landmarks) {
    ASSERT_GE(mark.vertex, 0) << name;
    ASSERT_LT(mark.vertex, 845) << name;
    EXPECT_TRUE(vertices.insert(mark.vertex).second) << name << " shares its vertex";
    EXPECT_EQ(t.landmarks.at(mirrored_landmark(name)).vertex, t.mirror[mark.vertex]) << name;
    EXPECT_TRUE(position(mark.point, t.V, t.levels[0].F).transpose() == t.V.row(mark.vertex)) << name;
  }
}

TEST(DefaultReference, LandmarksCoverMoreThanTheInnerFace) {
  const auto& t = reference();
  int outside = 0;
  for (const auto& [name, mark] : t.landmarks) {
    const Eigen::Vector3d p = t.V.row(mark.vertex);
    outside += std::abs(p.x()) > 45 || p.y() > 30 || p.y() < -85;
  }
  EXPECT_GE(outside, 30);
}

TEST(DefaultReference, TrianglesAreWellShapedAndNoEdgeFoldsPastARightAngle) {
  const auto& t = reference();
  for (const TemplateLevel& level : t.levels) {
    const Faces& F = level.F;
    double sharpest = 0, smallest = M_PI;
    for (const Edge& e : edges(F)) {
      if (e.is_boundary()) continue;
      const double c = face_normal(t.V, F, e.f0).dot(face_normal(t.V, F, e.f1));
      sharpest = std::max(sharpest, std::acos(std::clamp(c, -1.0, 1.0)));
    }
    for (int f = 0; f < F.rows(); ++f) smallest = std::min(smallest, smallest_angle(t.V, F, f));
    EXPECT_LT(sharpest, 90 * degree) << level.vertex_count;
    EXPECT_GT(smallest, (level.vertex_count == 845 ? 15 : 7.5) * degree) << level.vertex_count;
  }
}

TEST(DefaultReference, BaseMeshIsGradedAndItsValencesAreLow) {
  const auto& t = reference();
  const auto neighbours = vertex_neighbours(845, t.levels[0].F);
  int regular = 0;
  for (int v = 0; v < 845; ++v) {
    EXPECT_LE(neighbours.degree(v), 9);
    regular += neighbours.degree(v) >= 5 && neighbours.degree(v) <= 7;
  }
  EXPECT_GT(regular, 650);
  const auto mean_edge = [&](const char* name) {
    const int v = t.landmarks.at(name).vertex;
    double sum = 0;
    for (const int* n = neighbours.begin(v); n != neighbours.end(v); ++n) sum += (t.V.row(*n) - t.V.row(v)).norm();
    return sum / neighbours.degree(v);
  };
  for (const char* fine : {"31", "34", "44", "46", "52", "58", "64"})
    for (const char* coarse : {"left_forehead", "left_cheek", "left_gonion"})
      EXPECT_LT(mean_edge(fine), 0.8 * mean_edge(coarse)) << fine << ' ' << coarse;
}

// Fails when the mean head has changed: then run make-default-reference again (docs/reference.md).
TEST(DefaultReference, LiesOnTheMeanHeadWithItsLandmarksInPlace) {
  const auto& t = reference();
  const Landmarks truth = mean_head_landmarks();
  for (const auto& [name, mark] : t.landmarks)
    EXPECT_LT((t.V.row(mark.vertex).transpose() - truth.at(name).position).norm(), 0.3) << name;
  const auto& nostrils = t.regions.at("nostrils");
  for (int v = 0; v < t.base_count(); ++v)
    if (!std::binary_search(nostrils.begin(), nostrils.end(), v)) {
      const double d = mean_head_distance(t.V.row(v).transpose());
      EXPECT_LT(std::abs(d), 1.5) << t.V.row(v);
    }
}

TEST(DefaultReference, RegionsAreSymmetricAndWhereTheyShouldBe) {
  const auto& t = reference();
  for (const char* name : {"left_eye", "right_eye", "left_brow", "nose", "nostrils", "lips", "mouth_slit", "rim"})
    EXPECT_GE(t.regions.at(name).size(), 6u) << name;
  for (const auto& [name, vertices] : t.regions) {
    const auto& other = t.regions.at(mirrored_landmark(name));
    const std::set<int> partner(other.begin(), other.end());
    for (const int v : vertices) ASSERT_TRUE(partner.count(t.mirror[v])) << name;
  }
  for (const int v : t.regions.at("left_eye")) EXPECT_GT(t.V(v, 0), 10);
  const auto& lips = t.regions.at("lips");
  for (const int v : t.regions.at("mouth_slit")) EXPECT_TRUE(std::binary_search(lips.begin(), lips.end(), v));
  const auto on_border = boundary_vertices(t.V.rows(), t.levels.back().F);
  for (const int v : t.regions.at("rim")) EXPECT_TRUE(v >= t.base_count() || on_border[v]);
}

}  // namespace
}  // namespace facewright
