// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/contour.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <set>

#include "libmodel/core/errors.h"
#include "libmodel/render/head_pose.h"
#include "tests/libmodel/fitting/toy_model.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

Mesh ball(double radius, const Eigen::Vector3d& centre) {
  Mesh mesh = icosphere(4, radius);
  mesh.V.rowwise() += centre.transpose();
  return mesh;
}

Mesh joined(const Mesh& a, const Mesh& b) {
  Mesh mesh;
  mesh.V.resize(a.V.rows() + b.V.rows(), 3);
  mesh.V << a.V, b.V;
  mesh.F.resize(a.F.rows() + b.F.rows(), 3);
  mesh.F << a.F, b.F.array() + static_cast<int>(a.V.rows());
  return mesh;
}

OrthographicCamera camera_at(double yaw) { return {2, rotation({yaw, 0.2, 0.1}), {300, 200}}; }

TEST(VisibleOutline, OfASphereIsItsCircleWithNormalsOutwards) {
  const Mesh sphere = icosphere(4, 60);
  for (const double yaw : {0.0, 0.5, -1.2}) {
    const OrthographicCamera camera = camera_at(yaw);
    const auto outline = visible_outline(sphere.V, sphere.F, edges(sphere.F), camera.affine());
    EXPECT_GT(outline.size(), 80U);
    for (const OutlinePoint& p : outline) {
      const Eigen::Vector2d from_centre = p.pixel - camera.t;
      EXPECT_NEAR(from_centre.norm(), 120, 120 * 0.02);  // vertices within an edge of the circle
      EXPECT_GT(p.normal.dot(from_centre.normalized()), 0.98);
    }
  }
}

TEST(VisibleOutline, WhatIsHiddenBehindAnotherPartIsNoOutline) {
  const Mesh both = joined(ball(60, {0, 0, 100}), ball(25, {0, 0, -100}));
  const auto first_behind = static_cast<int>(icosphere(4, 60).V.rows());
  const OrthographicCamera front{2, Eigen::Matrix3d::Identity(), {300, 200}};
  for (const OutlinePoint& p : visible_outline(both.V, both.F, edges(both.F), front.affine()))
    EXPECT_LT(p.vertex, first_behind);
  // Turned by half a circle the small one is in front, and both are seen.
  const OrthographicCamera back{2, rotation({std::numbers::pi, 0, 0}), {300, 200}};
  const auto outline = visible_outline(both.V, both.F, edges(both.F), back.affine());
  EXPECT_TRUE(std::any_of(outline.begin(), outline.end(), [&](const auto& p) { return p.vertex >= first_behind; }));
  EXPECT_TRUE(std::any_of(outline.begin(), outline.end(), [&](const auto& p) { return p.vertex < first_behind; }));
}

TEST(VisibleOutline, ScalesAndShiftsWithTheImage) {
  const MorphableModel model = toy_model();
  const Mesh face = model.mean();
  const std::vector<Edge> E = edges(face.F);
  OrthographicCamera camera = camera_at(0.6);
  const auto a = visible_outline(face.V, face.F, E, camera.affine());
  camera.s *= 4;
  camera.t += Eigen::Vector2d(37, 11);
  const auto b = visible_outline(face.V, face.F, E, camera.affine());
  ASSERT_FALSE(a.empty());
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].vertex, b[i].vertex);
}

TEST(JawOutline, AddsTheModelsContoursWhereTheyAreSeenEachVertexOnce) {
  const MorphableModel model = toy_model();
  const Mesh face = model.mean();
  const auto outline = jaw_outline(face.V, face.F, model.contours(), camera_at(0.1).affine(), ContourOptions{});
  std::set<int> vertices;
  for (const OutlinePoint& p : outline) EXPECT_TRUE(vertices.insert(p.vertex).second);
  EXPECT_TRUE(vertices.count(model.landmarks().at("5").vertex));
  ContourOptions only;
  only.only_contours = true;
  EXPECT_LE(jaw_outline(face.V, face.F, model.contours(), camera_at(0.1).affine(), only).size(), 16U);
}

TEST(JawOutline, WithoutTheModelsContoursIsTheVisibleOutline) {
  const Mesh face = toy_model().mean();
  size_t points = 0;
  for (const double yaw : {-1.2, -0.5, 0.0, 0.3, 0.9}) {  // from the front the toy hides nothing of itself
    const AffineCamera camera = camera_at(yaw).affine();
    const auto by_edges = visible_outline(face.V, face.F, edges(face.F), camera);
    const auto by_triangles = jaw_outline(face.V, face.F, {}, camera);
    points += by_edges.size();
    ASSERT_EQ(by_edges.size(), by_triangles.size());
    for (size_t i = 0; i < by_edges.size(); ++i) {
      EXPECT_EQ(by_edges[i].vertex, by_triangles[i].vertex);
      EXPECT_EQ(by_edges[i].pixel, by_triangles[i].pixel);
      EXPECT_EQ(by_edges[i].normal, by_triangles[i].normal);
    }
  }
  EXPECT_GT(points, 20U);
}

TEST(JawOutline, LookingNearLandmarksOnlyMatchesThemAsLookingEverywhere) {
  const MorphableModel model = toy_model();
  const Mesh face = model.mean();
  const AffineCamera camera = camera_at(0.7).affine();
  OutlineSearch search{Pixels(9, 2), 30};
  for (int k = 0; k < 9; ++k)
    search.landmarks.row(k) =
        camera.project(face.V.row(model.landmarks().at(std::to_string(9 + k)).vertex)).transpose();
  const auto all = jaw_outline(face.V, face.F, model.contours(), camera, {});
  const auto near = jaw_outline(face.V, face.F, model.contours(), camera, {}, search);
  EXPECT_LT(near.size(), all.size());
  const auto a = match_outline(search.landmarks, all, 30), b = match_outline(search.landmarks, near, 30);
  for (size_t k = 0; k < a.size(); ++k) {
    ASSERT_EQ(a[k] < 0, b[k] < 0);
    if (a[k] >= 0) {
      EXPECT_EQ(all[static_cast<size_t>(a[k])].vertex, near[static_cast<size_t>(b[k])].vertex);
    }
  }
}

TEST(MatchOutline, IsOneToOneNearestFirstAndKeepsItsDistance) {
  std::vector<OutlinePoint> outline(3);
  for (int i = 0; i < 3; ++i) outline[static_cast<size_t>(i)].pixel = {10.0 * i, 0};
  Pixels pixels(4, 2);
  pixels << 1, 0, 0.5, 0, 19, 0, 100, 0;
  EXPECT_EQ(match_outline(pixels, outline, 12), (std::vector<int>{1, 0, 2, -1}));
  EXPECT_EQ(match_outline(pixels, outline, 2), (std::vector<int>{-1, 0, 2, -1}));
  EXPECT_EQ(match_outline(pixels, {}, 2), (std::vector<int>{-1, -1, -1, -1}));
}

TEST(VisibleOutline, RefusesTrianglesOutOfRangeAndPositionsThatAreNotFinite) {
  Mesh sphere = icosphere(2, 60);
  const std::vector<Edge> E = edges(sphere.F);
  const AffineCamera camera = camera_at(0).affine();
  Mesh broken = sphere;
  broken.F(0, 0) = 10000;
  EXPECT_THROW(visible_outline(broken.V, broken.F, E, camera), InvalidInput);
  sphere.V(3, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(visible_outline(sphere.V, sphere.F, E, camera), InvalidInput);
}

}  // namespace
}  // namespace facewright
