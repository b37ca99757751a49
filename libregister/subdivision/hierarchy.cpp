// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/subdivision/hierarchy.h"

#include <algorithm>
#include <cstdlib>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"

namespace facewright {
namespace {

// Singles that make two uniform steps give that many vertices.
int wanted_singles(const Mesh& base, int first_budget) {
  return first_budget - static_cast<int>(base.vertex_count()) - static_cast<int>(edges(base.F).size());
}

// The first two steps; the second is uniform if that hits the budget.
FourEightMesh first_level(const Mesh& base, const std::vector<int>& mirror, const RefinementTarget& target,
                          const HierarchyOptions& options) {
  FourEightMesh mesh = tri_quad_mesh(base, mirror, target.vertices, options.max_adjustment);
  const int pairs_and_singles = mesh.vertex_count() - static_cast<int>(base.vertex_count());
  const int singles = 2 * pairs_and_singles - static_cast<int>(base.face_count());  // 2 pairs + singles = triangles
  if (singles == wanted_singles(base, target.vertices))
    mesh.uniform_step();
  else
    refine_to(mesh, target, options.criterion);
  return mesh;
}

std::vector<RefinementTarget> refinement_targets(const Mesh& base, bool symmetric, const std::vector<int>& budgets,
                                                 std::vector<int> boundary_edges) {
  constexpr int surrey_border = 80;
  if (boundary_edges.empty() && budgets == kSurreyLevels && boundary_edge_count(base.F) == surrey_border)
    boundary_edges = surrey_boundary_edges(symmetric);
  boundary_edges.resize(budgets.size(), -1);
  std::vector<RefinementTarget> targets;
  for (size_t i = 0; i < budgets.size(); ++i) targets.push_back({budgets[i], boundary_edges[i]});
  return targets;
}

// Template with everything but the levels above the base.
MultiresTemplate begin_template(const Mesh& base, const std::vector<int>& mirror, const LandmarkSet& landmarks) {
  MultiresTemplate result;
  result.landmarks = landmarks;
  result.levels.push_back({static_cast<int>(base.vertex_count()), base.F});
  result.V = base.V;
  result.mirror = mirror;
  return result;
}

void finish_template(const FourEightMesh& mesh, const Vertices& base, MultiresTemplate* result) {
  result->parents = mesh.parents();
  result->mirror = mesh.mirror();
  result->V = refine_field(result->parents, mesh.base_count(), base, mesh.vertex_count());
}

void check(const Mesh& base, const LandmarkSet& landmarks, const std::vector<int>& budgets,
           const HierarchyOptions& options) {
  validate(base);
  if (!options.criterion) throw InvalidInput("hierarchy: no refinement criterion");
  if (!(options.max_adjustment >= 0 && options.max_adjustment <= 1))
    throw InvalidInput("hierarchy: max_adjustment must be in 0..1");
  if (!options.boundary_edges.empty() && options.boundary_edges.size() != budgets.size())
    throw InvalidInput("hierarchy: " + std::to_string(options.boundary_edges.size()) + " boundary counts for " +
                       std::to_string(budgets.size()) + " budgets");
  check_budgets(static_cast<int>(base.vertex_count()), budgets);
  for (const auto& [name, mark] : landmarks)
    if (mark.vertex >= base.vertex_count() || mark.point.triangle >= base.face_count())
      throw InvalidInput("hierarchy: landmark " + name + " is not on the base mesh");
}

}  // namespace

void check_budgets(int base_count, const std::vector<int>& budgets) {
  int below = base_count;
  for (const int budget : budgets) {
    if (budget <= below)
      throw InvalidInput("hierarchy: vertex budgets must increase from " + std::to_string(base_count));
    below = budget;
  }
}

std::vector<int> surrey_boundary_edges(bool symmetric) {
  return symmetric ? std::vector{-1, 306, 410} : std::vector{-1, 307, 411};
}

FourEightMesh tri_quad_mesh(const Mesh& base, const std::vector<int>& mirror, int first_budget, double max_adjustment) {
  const int wanted = wanted_singles(base, first_budget);
  TrianglePairing pairing = pair_triangles(base.V, base.F, mirror);
  const int change = std::abs(wanted - pairing.singles);
  if (wanted >= 0 && change > 0 && change <= max_adjustment * static_cast<double>(base.face_count())) {
    const TrianglePairing adjusted = pair_triangles(base.V, base.F, mirror, wanted);
    if (adjusted.singles == wanted) pairing = adjusted;
  }
  FourEightMesh mesh(base.V, base.F, mirror, pairing);
  if (first_budget < mesh.vertex_count())
    throw InvalidInput("hierarchy: the first level needs at least " + std::to_string(mesh.vertex_count()) +
                       " vertices, the budget is " + std::to_string(first_budget));
  return mesh;
}

MultiresTemplate build_hierarchy(const Mesh& base, const std::vector<int>& mirror, const LandmarkSet& landmarks,
                                 const std::vector<int>& budgets, const HierarchyOptions& options) {
  check(base, landmarks, budgets, options);
  MultiresTemplate result = begin_template(base, mirror, landmarks);
  if (budgets.empty()) return result;
  const auto targets = refinement_targets(base, !mirror.empty(), budgets, options.boundary_edges);
  FourEightMesh mesh = first_level(base, mirror, targets.front(), options);
  result.levels.push_back({mesh.vertex_count(), mesh.faces()});
  if (options.first_level_positions.rows() > 0) mesh.set_positions(options.first_level_positions);
  for (size_t i = 1; i < targets.size(); ++i) {
    refine_to(mesh, targets[i], options.criterion);
    result.levels.push_back({mesh.vertex_count(), mesh.faces()});
  }
  finish_template(mesh, base.V, &result);
  return result;
}

MultiresTemplate uniform_hierarchy(const Mesh& base, const std::vector<int>& mirror, const LandmarkSet& landmarks,
                                   int first_budget, const std::vector<int>& steps) {
  check(base, landmarks, {}, {});
  MultiresTemplate result = begin_template(base, mirror, landmarks);
  FourEightMesh mesh = tri_quad_mesh(base, mirror, first_budget);
  int done = 1;  // the pairing is the first step
  for (const int count : steps) {
    if (count < 1) throw InvalidInput("hierarchy: a level needs at least one uniform step");
    for (int step = done; step < count; ++step) mesh.uniform_step();
    done = 0;
    result.levels.push_back({mesh.vertex_count(), mesh.faces()});
  }
  finish_template(mesh, base.V, &result);
  return result;
}

std::vector<int> refine_region(const MultiresTemplate& reference, const std::vector<int>& base_region) {
  std::vector<bool> inside(static_cast<size_t>(reference.V.rows()), false);
  for (const int v : base_region) inside.at(static_cast<size_t>(v)) = true;
  const auto base = static_cast<size_t>(reference.base_count());
  for (size_t i = 0; i < reference.parents.size(); ++i) {
    const VertexParents& p = reference.parents[i];
    inside[base + i] = inside[p.a] && inside[p.b] && (p.is_midpoint() || inside[p.c]);
  }
  std::vector<int> result;
  for (size_t v = 0; v < inside.size(); ++v)
    if (inside[v]) result.push_back(static_cast<int>(v));
  return result;
}

}  // namespace facewright
