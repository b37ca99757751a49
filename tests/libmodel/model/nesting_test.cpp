// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/nesting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "libmodel/core/errors.h"
#include "libmodel/model/level_topology.h"
#include "libmodel/model/surface_points.h"
#include "model_fixtures.h"

namespace facewright {
namespace {

const NestingRow* broken(const std::vector<NestingRow>& rows) {
  const NestingRow* found = nullptr;
  for (const NestingRow& row : rows)
    if (!row.holds()) found = &row;
  return found;
}

TEST(Nesting, LevelsOfAModelLeadOneAnotherExactly) {
  const MorphableModel model(testing::random_parts(1));
  for (int l = 0; l + 1 < model.level_count(); ++l) {
    const auto rows = compare_levels(model.level(l), model.level(l + 1));
    EXPECT_GE(rows.size(), 12u);
    for (const NestingRow& row : rows) EXPECT_EQ(row.deviation, 0) << row.quantity;
    EXPECT_EQ(largest_deviation(rows), 0);
  }
}

bool is_measured(const std::string& quantity) {
  return quantity.find("mean") != quantity.npos || quantity.find("rows") != quantity.npos || quantity == "positions" ||
         quantity == "colours" || quantity == "texture coordinates";
}

// One number of each quantity is changed; the row of that quantity says by how much.
TEST(Nesting, EveryQuantityThatIsBrokenIsNamedWithItsDeviation) {
  const MorphableModel model(testing::random_parts(2));
  const MorphableModel fine = model.level(2);
  const std::vector<std::pair<std::string, std::function<void(MorphableModelParts&)>>> changes = {
      {"positions", [](auto& p) { p.shape.mean[7] += 0.25; }},
      {"shape basis rows", [](auto& p) { p.shape.basis(3, 1) += 0.25; }},
      {"colours", [](auto& p) { p.colour.mean[2] += 0.25; }},
      {"colour basis rows", [](auto& p) { p.colour.basis(0, 0) += 0.25; }},
      {"expression mean", [](auto& p) { p.expression->mean[1] += 0.25; }},
      {"texture coordinates", [](auto& p) { p.uv(5, 1) += 0.25; }},
      {"landmark vertices", [](auto& p) { p.landmarks["31"].vertex = 2; }},
      {"regions", [](auto& p) { p.regions["lips"].pop_back(); }},
      {"contours", [](auto& p) { std::swap(p.regions["left_contour"][0], p.regions["left_contour"][1]); }},
      {"symmetry", [](auto& p) { std::swap(p.mirror[2], p.mirror[3]); }},
      {"parents", [](auto& p) { p.parents[3].a -= 1; }}};
  for (const auto& [quantity, change] : changes) {
    MorphableModelParts parts = model.level(1).parts();
    change(parts);
    const auto rows = compare_levels(MorphableModel(parts), fine);
    EXPECT_FALSE(all_hold(rows)) << quantity;
    const auto row = std::find_if(rows.begin(), rows.end(), [&](const auto& r) { return r.quantity == quantity; });
    ASSERT_NE(row, rows.end()) << quantity;
    EXPECT_FALSE(row->holds()) << quantity;
    if (is_measured(quantity)) {
      EXPECT_NEAR(row->deviation, 0.25, 1e-12) << quantity;
    }
  }
}

TEST(Nesting, BasesMadeOrthonormalLevelByLevelAreTheSameUpToARotation) {
  const MorphableModel model(testing::random_parts(3));
  MorphableModelParts parts = model.level(1).parts();
  parts.shape = parts.shape.orthonormalised();
  auto rows = compare_levels(MorphableModel(parts), model.level(2));
  EXPECT_TRUE(all_hold(rows)) << broken(rows)->quantity;
  EXPECT_TRUE(std::any_of(rows.begin(), rows.end(), [](const NestingRow& r) {
    return r.quantity == "shape basis rows up to a rotation" && r.deviation < 1e-9;
  }));
  parts.shape.basis(4, 2) += 0.01;
  rows = compare_levels(MorphableModel(parts), model.level(2));
  ASSERT_FALSE(all_hold(rows));
  EXPECT_EQ(broken(rows)->quantity, "shape basis rows up to a rotation");
}

// What one of the two does not have is a row that fails, whichever of the two it is.
TEST(Nesting, MissingOrSmallerPartsAreDeviationsNotErrors) {
  const MorphableModel model(testing::random_parts(6));
  const auto expect_missing = [&](const MorphableModel& coarse, const MorphableModel& fine, const std::string& what) {
    const auto rows = compare_levels(coarse, fine);
    EXPECT_TRUE(std::any_of(rows.begin(), rows.end(), [&](const NestingRow& r) {
      return !r.holds() && r.quantity.find(what) != r.quantity.npos;
    })) << what;
  };
  const auto without = [](const MorphableModel& level, auto change) {
    MorphableModelParts p = level.parts();
    change(p);
    return MorphableModel(std::move(p));
  };
  const auto no_colour = [](auto& p) { p.colour = {}; };
  const auto no_expression = [](auto& p) { p.expression.reset(); };
  const auto no_modes = [](auto& p) { p.shape = p.shape.truncated(0); };
  const auto orthonormal = [](auto& p) { p.shape = p.shape.orthonormalised(), p.colour = p.colour.orthonormalised(); };
  for (const auto& [coarse, fine] : {std::pair(model.level(0), model.level(1)),
                                     {without(model.level(0), orthonormal), without(model.level(1), orthonormal)}}) {
    expect_missing(without(coarse, no_colour), fine, "colour basis");
    expect_missing(coarse, without(fine, no_colour), "colour basis");
    expect_missing(without(coarse, no_expression), fine, "expression basis");
    expect_missing(coarse, without(fine, no_expression), "expression basis");
    expect_missing(without(coarse, no_modes), fine, "shape basis");
    expect_missing(coarse, without(fine, no_modes), "shape basis");
    expect_missing(fine, coarse, "positions");  // the wrong way round
  }
}

// A square of two triangles; the diagonal is bisected, then the sides, as 4-8 refinement does.
struct Square {
  Vertices V{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 0}, {0.5, 0, 0}, {0, 0.5, 0}};
  Faces coarse{{0, 1, 2}, {0, 2, 3}};
  Faces fine{{0, 5, 4}, {5, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 6, 4}, {6, 0, 4}};
  std::vector<VertexParents> parents{{0, 2}, {0, 1}, {0, 3}};
};

TEST(CarryPoint, StaysWhereItIsOnARefinedMesh) {
  const Square s;
  Random random(4);
  for (int i = 0; i < 200; ++i) {
    Eigen::Vector3d b(random.uniform(), random.uniform(), random.uniform());
    if (i % 5 == 0) b[i % 3] = 0;  // on an edge
    const SurfacePoint point{i % 2, b / b.sum()};
    const SurfacePoint carried = carry_point(point, s.coarse, 4, s.parents, s.fine);
    EXPECT_GE(carried.barycentric.minCoeff(), 0);
    EXPECT_NEAR((position(carried, s.V, s.fine) - position(point, s.V, s.coarse)).norm(), 0, 1e-14);
  }
}

TEST(CarryPoint, FollowsTheSurfaceWhenVerticesMove) {
  Square s;
  const SurfacePoint point{0, {0.5, 0, 0.5}};  // the middle of the diagonal: the vertex 4 of the fine mesh
  s.V.row(4) = Eigen::RowVector3d(0.4, 0.5, 0.3);
  const SurfacePoint carried = carry_point(point, s.coarse, 4, s.parents, s.fine);
  EXPECT_NEAR((position(carried, s.V, s.fine).transpose() - s.V.row(4)).norm(), 0, 1e-15);
}

TEST(CarryPoint, RefusesTrianglesThatDoNotExist) {
  const Square s;
  EXPECT_THROW(carry_point({2, {1, 0, 0}}, s.coarse, 4, s.parents, s.fine), InvalidInput);
  EXPECT_THROW(carry_point({1, {0.2, 0.3, 0.5}}, s.coarse, 4, s.parents, s.fine.topRows(1)), InvalidInput);
}

TEST(LevelTopology, CountsWhatASquareHas) {
  const Square s;
  const LevelTopology t = level_topology(s.fine, 7, {0, 3, 2, 1, 4, 6, 5});
  EXPECT_EQ(t.boundary_edges, 6);
  EXPECT_EQ(t.euler, 1);
  EXPECT_TRUE(t.sound());
  EXPECT_EQ(t.mirror_errors, 0);
}

TEST(LevelTopology, SeesWhatIsWrong) {
  const Square s;
  EXPECT_FALSE(level_topology(s.fine, 8, {}).manifold) << "a vertex in no triangle";
  Faces turned = s.fine;
  std::swap(turned(2, 0), turned(2, 1));
  EXPECT_FALSE(level_topology(turned, 7, {}).oriented);
  EXPECT_GT(level_topology(s.fine, 7, {0, 1, 2, 3, 4, 6, 5}).mirror_errors, 0) << "triangles without image";
  EXPECT_GT(level_topology(s.fine, 7, {0, 3, 2, 2, 4, 6, 5}).mirror_errors, 0) << "no involution";
  Faces fan(3, 3);
  fan << 0, 1, 2, 1, 0, 3, 0, 1, 4;
  EXPECT_FALSE(level_topology(fan, 5, {}).manifold);
}

TEST(Companions, OfALevelAreThoseBelowItsVertexCount) {
  const MorphableModel model(testing::random_parts(5));
  EXPECT_EQ(model.contours(0).left, (std::vector<int>{1}));
  EXPECT_EQ(model.contours(2).left, (std::vector<int>{1, 15, 33}));
  EXPECT_EQ(model.regions(1).at("lips"), (std::vector<int>{3, 4, 11, 19}));
  EXPECT_TRUE(model.contours(0).right.empty()) << "landmark 9 belongs to neither side";
  EXPECT_EQ(model.edge_topology(0).size(), 21u);  // a strip of ten triangles
}

TEST(Companions, LandmarksThatAreNoVerticesHaveAPlaceOnEveryLevel) {
  const Square s;
  MultiresTemplate reference;
  reference.V = s.V;
  reference.levels = {{4, s.coarse}, {7, s.fine}};
  reference.parents = s.parents;
  reference.landmarks["31"] = {{1, {0.2, 0.3, 0.5}}, -1};
  reference.landmarks["9"] = {{0, {0, 1, 0}}, 1};
  MorphableModelParts p;
  p.shape.mean = as_vector(s.V);
  p.shape.basis.resize(21, 0);
  p.parents = s.parents;
  p.base_faces = s.coarse;
  p.landmarks = landmarks_on_vertices(reference.landmarks, s.coarse, s.coarse);
  for (int l = 0; l < 2; ++l)
    p.levels.push_back({reference.levels[l].vertex_count, reference.levels[l].F, landmark_points(reference, l)});
  const MorphableModel model(p);
  EXPECT_EQ(model.landmarks().at("31").vertex, 3) << "the nearest corner, for those who know vertices only";
  const Eigen::Vector3d x = position({1, {0.2, 0.3, 0.5}}, s.V, s.coarse);
  for (int l = 0; l < 2; ++l) {
    EXPECT_EQ(model.landmarks(l).at("31").vertex, -1);
    EXPECT_EQ(model.landmarks(l).at("9").vertex, 1);
    const Landmarks located = locate(model.landmarks(l), model.mean(l).V, model.faces(l));
    EXPECT_NEAR((located.at("31").position - x).norm(), 0, 1e-15);
  }
  for (const NestingRow& row : compare_levels(model.level(0), model.level(1)))
    EXPECT_EQ(row.deviation, 0) << row.quantity;
}

// A model whose fine triangles are not parts of the coarse ones: the place cannot be carried, which is a row that
// fails.
TEST(Companions, PlacesThatCannotBeCarriedAreADeviation) {
  const Square s;
  const auto model_of = [&](const Vertices& V, const Faces& F, const std::vector<VertexParents>& parents) {
    MorphableModelParts p;
    p.shape.mean = as_vector(V);
    p.shape.basis.resize(3 * V.rows(), 0);
    p.parents = parents;
    p.landmarks["31"].vertex = 3;
    p.levels = {{static_cast<int>(V.rows()), F}};
    p.levels[0].landmark_points["31"] = {0, {0.2, 0.3, 0.5}};
    return MorphableModel(p);
  };
  const MorphableModel coarse = model_of(s.V.topRows(4), s.coarse, {});
  for (const NestingRow& row : compare_levels(coarse, model_of(s.V, s.fine.middleRows(3, 1), s.parents))) {
    EXPECT_EQ(row.holds(), row.quantity != "landmark places") << row.quantity;
  }
  const MorphableModel fine = model_of(s.V, s.fine, s.parents);
  EXPECT_FALSE(all_hold(compare_levels(fine, coarse))) << "the wrong way round";
}

}  // namespace
}  // namespace facewright
