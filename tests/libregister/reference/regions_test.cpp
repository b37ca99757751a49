// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/reference/regions.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "libmodel/core/topology.h"
#include "libregister/reference/reference_face.h"

namespace facewright {
namespace {

using ::testing::ElementsAre;
using ::testing::Key;
using ::testing::UnorderedElementsAre;

const char* const kAreas[] = {"left_eye", "right_eye",  "left_brow",   "right_brow", "lips",
                              "nose",     "left_cheek", "right_cheek", "chin",       "forehead"};

const MultiresTemplate& reference() {
  static const MultiresTemplate t = default_reference();
  return t;
}

Landmarks marks() { return locate(reference().landmarks, reference().V, reference().levels[0].F); }

const RegionMap& derived() {
  static const RegionMap r = face_regions(reference().level_mesh(2), marks(),
                                          {reference().mirror.begin(), reference().mirror.begin() + 16759});
  return r;
}

bool contains(const std::vector<int>& sorted, int v) { return std::binary_search(sorted.begin(), sorted.end(), v); }

std::vector<int> below(const std::vector<int>& vertices, int n) {
  std::vector<int> kept;
  std::copy_if(vertices.begin(), vertices.end(), std::back_inserter(kept), [n](int v) { return v < n; });
  return kept;
}

TEST(FaceRegions, AreasDoNotOverlapAndHolesAreInTheirAreas) {
  for (const RegionMap& regions : {derived(), reference().regions}) {
    std::set<int> taken;
    for (const char* area : kAreas) {
      ASSERT_TRUE(regions.count(area)) << area;
      for (const int v : regions.at(area)) EXPECT_TRUE(taken.insert(v).second) << area << " " << v;
    }
    for (const int v : regions.at("nostrils")) EXPECT_TRUE(contains(regions.at("nose"), v));
    for (const int v : regions.at("mouth_slit")) EXPECT_TRUE(contains(regions.at("lips"), v));
  }
}

// Points of anatomy that the regions are not made from.
TEST(FaceRegions, HoldTheAnatomicalPointsOfTheirName) {
  const std::pair<const char*, const char*> expected[] = {
      {"metopion", "forehead"},     {"glabella", "forehead"},        {"left_forehead", "forehead"},
      {"pogonion", "chin"},         {"labiomental", "chin"},         {"left_infraorbital", "left_cheek"},
      {"left_cheek", "left_cheek"}, {"left_buccal", "left_cheek"},   {"right_zygion", "right_cheek"},
      {"left_tip", "nose"},         {"left_alar_curvature", "nose"}, {"right_nasal_wall", "nose"}};
  for (const auto& [mark, region] : expected)
    EXPECT_TRUE(contains(derived().at(region), reference().landmarks.at(mark).vertex)) << mark;
}

TEST(FaceRegions, AreSymmetricWhereTheMeshIs) {
  for (const auto& [name, vertices] : reference().regions) {
    const auto& other = reference().regions.at(mirrored_landmark(name));
    const std::set<int> partner(other.begin(), other.end());
    ASSERT_EQ(partner.size(), vertices.size()) << name;
    for (const int v : vertices) ASSERT_TRUE(partner.count(reference().mirror[static_cast<size_t>(v)])) << name;
  }
}

TEST(FaceRegions, DrawnOnACoarserLevelAreThoseOfTheFinerBelowItsVertexCount) {
  for (size_t l = 0; l < 2; ++l) {
    const int n = reference().levels[l].vertex_count;
    const RegionMap coarse = face_regions(reference().level_mesh(static_cast<int>(l)), marks(),
                                          {reference().mirror.begin(), reference().mirror.begin() + n});
    for (const char* area : kAreas) EXPECT_EQ(coarse.at(area), below(derived().at(area), n)) << area << " " << n;
  }
}

TEST(FaceRegions, DoNotMindWhereTheHeadIs) {
  Mesh mesh = reference().level_mesh(1);
  Landmarks moved = marks();
  const Eigen::RowVector3d shift(0, -37.5, 112);
  mesh.V.rowwise() += shift;
  for (auto& [name, mark] : moved) mark.position += shift.transpose();
  const RegionMap regions = face_regions(mesh, moved, {reference().mirror.begin(), reference().mirror.begin() + 3448});
  for (const char* area : kAreas) EXPECT_EQ(regions.at(area), below(derived().at(area), 3448)) << area;
}

TEST(FaceRegions, FollowTheLandmarksOfAnAsymmetricFace) {
  Mesh mesh = reference().level_mesh(1);
  Landmarks marked = marks();
  const auto bend = [](auto&& x) { x[0] += 0.1 * (x[1] + 40); };  // the chin to one side
  for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) bend(mesh.V.row(v));
  for (auto& [name, mark] : marked) bend(mark.position);
  const RegionMap regions = face_regions(mesh, marked, {});
  for (const char* area : kAreas) {
    const auto expected = below(derived().at(area), 3448);
    std::vector<int> common;
    std::set_intersection(expected.begin(), expected.end(), regions.at(area).begin(), regions.at(area).end(),
                          std::back_inserter(common));
    EXPECT_GT(2.0 * static_cast<double>(common.size()),
              0.9 * static_cast<double>(expected.size() + regions.at(area).size()))
        << area;
  }
}

TEST(FaceRegions, LeaveOutWhatTheLandmarksDoNotTell) {
  const Mesh mesh = reference().level_mesh(0);
  EXPECT_THAT(face_regions(mesh, Landmarks{}, {}), UnorderedElementsAre(Key("rim")));
  Landmarks eyes;
  for (int i = 37; i <= 48; ++i) eyes[std::to_string(i)] = marks().at(std::to_string(i));
  EXPECT_THAT(face_regions(mesh, eyes, {}), UnorderedElementsAre(Key("rim"), Key("left_eye"), Key("right_eye")));
}

TEST(LandmarkPath, RunsAlongEdgesThroughEveryLandmark) {
  const Mesh mesh = reference().level_mesh(0);
  const std::vector<int> path = landmark_path(mesh, reference().landmarks, {"17", "13", "9"});
  const Adjacency neighbours = vertex_neighbours(mesh.V.rows(), mesh.F);
  for (size_t i = 0; i + 1 < path.size(); ++i)
    EXPECT_TRUE(std::count(neighbours.begin(path[i]), neighbours.end(path[i]), path[i + 1]));
  EXPECT_EQ(path.front(), reference().landmarks.at("17").vertex);
  EXPECT_EQ(path.back(), reference().landmarks.at("9").vertex);
  EXPECT_TRUE(std::count(path.begin(), path.end(), reference().landmarks.at("13").vertex));
  EXPECT_TRUE(landmark_path(mesh, reference().landmarks, {"17", "no such mark"}).empty());
}

TEST(Contours, AreUnbrokenEdgePathsOfEveryLevelThroughTheJawLandmarks) {
  for (const char* name : {"left_contour", "right_contour"})
    for (const TemplateLevel& level : reference().levels) {
      const std::vector<int> path = below(reference().regions.at(name), level.vertex_count);
      const Adjacency neighbours = vertex_neighbours(level.vertex_count, level.F);
      for (size_t i = 0; i + 1 < path.size(); ++i)
        ASSERT_TRUE(std::count(neighbours.begin(path[i]), neighbours.end(path[i]), path[i + 1]))
            << name << " breaks at " << i << " of " << level.vertex_count;
      const int first = name[0] == 'l' ? 10 : 1;
      for (int i = first; i < first + 8; ++i)
        EXPECT_TRUE(std::count(path.begin(), path.end(), reference().landmarks.at(std::to_string(i)).vertex)) << i;
      EXPECT_FALSE(std::count(path.begin(), path.end(), reference().landmarks.at("9").vertex));
    }
}

// Seen from the front, from a point between nose and mouth: no vertex in the direction of a contour vertex lies farther
// out by more than what the side of the head adds behind the jaw.
TEST(Contours, LieOnTheOutlineSeenFromTheFront) {
  const Vertices& V = reference().V;
  const auto polar = [&](Eigen::Index v) {
    const Eigen::Vector2d d(V(v, 0), V(v, 1) + 50);
    return std::pair(std::atan2(d.y(), d.x()), d.norm());
  };
  for (const int v : reference().regions.at("left_contour")) {
    const auto [angle, radius] = polar(v);
    double outermost = 0;
    for (Eigen::Index w = 0; w < V.rows(); ++w)
      if (const auto [a, r] = polar(w); std::abs(a - angle) < 0.02) outermost = std::max(outermost, r);
    EXPECT_LT(outermost - radius, 4) << V.row(v);
  }
}

TEST(TemplateRegions, KeepWhatIsGivenForTheBase) {
  const RegionMap regions = template_regions(reference(), {{"nose", {3, 4, 5}}, {"scar", {10}}});
  EXPECT_THAT(below(regions.at("nose"), 845), ElementsAre(3, 4, 5));
  EXPECT_THAT(regions.at("scar"), ElementsAre(10));
  EXPECT_EQ(below(regions.at("chin"), 16759), derived().at("chin"));
}

}  // namespace
}  // namespace facewright
