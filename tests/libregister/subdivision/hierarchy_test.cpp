// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/subdivision/hierarchy.h"

#include <gmock/gmock.h>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "tests/libregister/subdivision/shapes.h"

namespace facewright {
namespace {

using test::annulus;

TEST(BuildHierarchy, HitsEveryBudgetExactlyWithAndWithoutSymmetry) {
  const auto s = annulus(8, 12, 2.0);
  for (const auto& mirror : {std::vector<int>{}, s.mirror})
    for (const std::vector<int>& budgets : {std::vector{900, 3001, 7000}, std::vector{1033, 1034, 1037, 1500}}) {
      const auto t = build_hierarchy(s.mesh, mirror, {}, budgets);
      ASSERT_EQ(t.levels.size(), budgets.size() + 1);
      for (size_t l = 0; l < budgets.size(); ++l) {
        const TemplateLevel& level = t.levels[l + 1];
        EXPECT_EQ(level.vertex_count, budgets[l]);
        EXPECT_EQ(level.F.maxCoeff() + 1, budgets[l]);
        EXPECT_EQ(level.F.rows(), 2 * budgets[l] - boundary_edge_count(level.F));
        EXPECT_TRUE(mirror.empty() || boundary_edge_count(level.F) % 2 == 0);
      }
      EXPECT_EQ(t.V.rows(), budgets.back());
      EXPECT_EQ(t.mirror.size(), mirror.empty() ? 0 : static_cast<size_t>(budgets.back()));
    }
}

TEST(BuildHierarchy, AdjustsThePairingSoThatTwoUniformStepsHitTheFirstBudget) {
  const auto s = test::crooked_annulus(8, 12);
  const int base = static_cast<int>(s.mesh.V.rows() + static_cast<Eigen::Index>(edges(s.mesh.F).size()));
  const int greedy = pair_triangles(s.mesh.V, s.mesh.F, s.mirror).singles;
  for (const int singles : {greedy, greedy + 2, greedy + 12}) {
    const auto t = build_hierarchy(s.mesh, s.mirror, {}, {base + singles});
    EXPECT_EQ(t.levels[1].vertex_count, base + singles);
    EXPECT_EQ(t.levels[1].F.rows(), 4 * s.mesh.F.rows() + 2 * singles);
    EXPECT_EQ(boundary_edge_count(t.levels[1].F), 2 * boundary_edge_count(s.mesh.F));
  }
}

TEST(BuildHierarchy, LevelsAreSymmetricPrefixes) {
  const auto s = annulus(8, 12, 2.0);
  const auto t = build_hierarchy(s.mesh, s.mirror, {}, {1100, 4001});
  EXPECT_TRUE(t.V.topRows(s.mesh.V.rows()) == s.mesh.V);
  for (size_t i = 0; i < t.parents.size(); ++i) {
    const int v = t.base_count() + static_cast<int>(i);
    EXPECT_LT(std::max({t.parents[i].a, t.parents[i].b, t.parents[i].c}), v);
  }
  for (const TemplateLevel& level : t.levels) {
    const std::vector<int> mirror(t.mirror.begin(), t.mirror.begin() + level.vertex_count);
    EXPECT_NO_THROW(mirrored_triangles(level.F, mirror));
  }
  Vertices reflected = t.V;
  reflected.col(0) *= -1;
  for (int v = 0; v < t.V.rows(); ++v) ASSERT_NEAR((reflected.row(v) - t.V.row(t.mirror[v])).norm(), 0, 1e-12);
}

TEST(BuildHierarchy, IsTheSameEveryTime) {
  const auto s = annulus(6, 8, 2.0);
  const auto a = build_hierarchy(s.mesh, s.mirror, {}, {600, 2001});
  const auto b = build_hierarchy(s.mesh, s.mirror, {}, {600, 2001});
  EXPECT_TRUE(a.V == b.V);
  EXPECT_TRUE(a.levels.back().F == b.levels.back().F);
}

TEST(BuildHierarchy, PutsMoreVerticesWhereTheSurfaceBends) {
  auto s = annulus(8, 16);
  for (int v = 0; v < s.mesh.V.rows(); ++v) s.mesh.V(v, 2) = s.mesh.V(v, 1) > 9 ? std::sin(s.mesh.V(v, 1) - 9) : 0;
  const auto upper_share = [&](double weight) {
    HierarchyOptions options;
    options.criterion = bent_length_criterion(weight);
    const auto t = build_hierarchy(s.mesh, s.mirror, {}, {1200, 4000}, options);
    return (t.V.col(1).array() > 9).cast<double>().mean();
  };
  EXPECT_GT(upper_share(4), 1.1 * upper_share(0));
}

TEST(BuildHierarchy, RefinesByThePositionsGivenForTheFirstLevel) {
  const auto s = annulus(8, 12);
  const auto flat = build_hierarchy(s.mesh, s.mirror, {}, {1100, 3000});
  HierarchyOptions options;
  options.first_level_positions = flat.level_mesh(1).V;
  options.first_level_positions.col(1) *= 5;  // taller: the upright edges are split first
  const auto tall = build_hierarchy(s.mesh, s.mirror, {}, {1100, 3000}, options);
  EXPECT_TRUE(flat.levels[1].F == tall.levels[1].F);
  const Faces &f = flat.levels[2].F, &g = tall.levels[2].F;
  EXPECT_FALSE(f.rows() == g.rows() && f == g);
  EXPECT_TRUE(tall.V.topRows(1100) == flat.V.topRows(1100));  // the template itself keeps its own positions
}

TEST(RefineRegion, KeepsVerticesAllOfWhoseParentsBelong) {
  const auto s = annulus(4, 6);
  const auto t = build_hierarchy(s.mesh, s.mirror, {}, {400});
  std::vector<int> lower;
  for (int v = 0; v < t.base_count(); ++v)
    if (t.V(v, 1) < 3) lower.push_back(v);
  double top = 0;
  for (const int v : lower) top = std::max(top, t.V(v, 1));
  const auto fine = refine_region(t, lower);
  EXPECT_GT(fine.size(), lower.size());
  for (const int v : fine) EXPECT_LE(t.V(v, 1), top);
}

TEST(BuildHierarchy, RefusesBudgetsThatCannotBe) {
  const auto s = annulus(4, 6);
  const int base = static_cast<int>(s.mesh.V.rows());
  EXPECT_THROW(build_hierarchy(s.mesh, s.mirror, {}, {base}), InvalidInput);
  EXPECT_THROW(build_hierarchy(s.mesh, s.mirror, {}, {base + 5}), InvalidInput);
  EXPECT_THROW(build_hierarchy(s.mesh, s.mirror, {}, {400, 300}), InvalidInput);
  MeshLandmark far_off;
  far_off.vertex = base;
  EXPECT_THROW(build_hierarchy(s.mesh, s.mirror, {{"31", far_off}}, {400}), InvalidInput);
  HierarchyOptions none;
  none.criterion = nullptr;
  EXPECT_THROW(build_hierarchy(s.mesh, s.mirror, {}, {400}, none), InvalidInput);
  EXPECT_THROW(bent_length_criterion(-1), InvalidInput);
}

}  // namespace
}  // namespace facewright
