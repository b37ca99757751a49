// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/subdivision/hierarchy.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <queue>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"

namespace facewright {
namespace {

// From here on the parity of what is missing is watched: enough for any chain of bisections on real meshes.
constexpr int kTail = 64;

struct Candidate {
  double key;
  int triangle, apex;  // stale once the triangle has another apex
  bool operator<(const Candidate& o) const { return key != o.key ? key < o.key : triangle > o.triangle; }
};

class Refiner {
 public:
  Refiner(FourEightMesh& mesh, int target, const RefinementCriterion& criterion)
      : mesh_(mesh), target_(target), criterion_(criterion) {
    for (int t = 0; t < mesh.face_count(); ++t) push(t);
  }

  void run() {
    while (missing() > kTail) must(step([&](int, int cost) { return cost <= missing(); }));
    const bool symmetric = !mesh_.mirror().empty();
    // Only a bisection on the midline adds an odd number. If all midline edges are sides, a neighbour makes one a base.
    const auto odd = [&](int, int cost) { return cost % 2 && cost <= missing(); };
    const auto beside_midline = [&](int t, int cost) { return cost < missing() && touches_midline(t); };
    while (symmetric && missing() % 2 && !step(odd)) must(step(beside_midline));
    while (missing() > 0) must(step([&](int, int cost) { return cost <= missing() && (!symmetric || cost % 2 == 0); }));
  }

 private:
  int missing() const { return target_ - mesh_.vertex_count(); }
  void push(int t) { queue_.push({criterion_(mesh_.base_edge(t)), t, mesh_.apex(t)}); }

  bool touches_midline(int t) const {
    const BaseEdge e = mesh_.base_edge(t);
    const auto own = [&](int v) { return mesh_.mirror()[v] == v; };
    return own(e.apex) && (own(e.a) || own(e.b));
  }

  // Bisects the first candidate that is acceptable, given its cost; those passed over stay candidates.
  template <class Acceptable>
  bool step(const Acceptable& acceptable) {
    std::vector<Candidate> passed;
    while (!queue_.empty()) {
      const Candidate c = queue_.top();
      queue_.pop();
      if (mesh_.apex(c.triangle) != c.apex) continue;
      if (acceptable(c.triangle, mesh_.cost(c.triangle))) {
        for (const int t : mesh_.bisect(c.triangle).changed) push(t);
        for (const Candidate& p : passed) queue_.push(p);
        return true;
      }
      passed.push_back(c);
    }
    for (const Candidate& p : passed) queue_.push(p);
    return false;
  }

  void must(bool done) const {
    if (!done)
      throw InvalidInput("refinement: " + std::to_string(target_) + " vertices cannot be hit, " +
                         std::to_string(mesh_.vertex_count()) + " is the nearest below" +
                         (mesh_.mirror().empty() ? "" : "; without symmetry it would do"));
  }

  FourEightMesh& mesh_;
  int target_;
  const RefinementCriterion& criterion_;
  std::priority_queue<Candidate> queue_;
};

// The base after the first 4-8 step, and after the second one if that hits the budget.
FourEightMesh first_level(const Mesh& base, const std::vector<int>& mirror, int budget,
                          const HierarchyOptions& options) {
  const int after_two_steps_without_singles =
      static_cast<int>(base.vertex_count()) + static_cast<int>(edges(base.F).size());
  const int wanted = budget - after_two_steps_without_singles;
  TrianglePairing pairing = pair_triangles(base.V, base.F, mirror);
  const int change = std::abs(wanted - pairing.singles);
  if (wanted >= 0 && change > 0 && change <= options.max_adjustment * static_cast<double>(base.face_count())) {
    const TrianglePairing adjusted = pair_triangles(base.V, base.F, mirror, wanted);
    if (adjusted.singles == wanted) pairing = adjusted;
  }
  FourEightMesh mesh(base.V, base.F, mirror, pairing);
  if (budget < mesh.vertex_count())
    throw InvalidInput("hierarchy: the first level needs at least " + std::to_string(mesh.vertex_count()) +
                       " vertices, the budget is " + std::to_string(budget));
  if (pairing.singles == wanted)
    mesh.uniform_step();
  else
    refine_to(mesh, budget, options.criterion);
  return mesh;
}

void check(const Mesh& base, const LandmarkSet& landmarks, const std::vector<int>& budgets,
           const HierarchyOptions& options) {
  validate(base);
  if (!options.criterion) throw InvalidInput("hierarchy: no refinement criterion");
  if (!(options.max_adjustment >= 0 && options.max_adjustment <= 1))
    throw InvalidInput("hierarchy: max_adjustment must be in 0..1");
  int below = static_cast<int>(base.vertex_count());
  for (const int budget : budgets) {
    if (budget <= below)
      throw InvalidInput("hierarchy: vertex budgets must increase from " + std::to_string(base.vertex_count()));
    below = budget;
  }
  for (const auto& [name, mark] : landmarks)
    if (mark.vertex >= base.vertex_count() || mark.point.triangle >= base.face_count())
      throw InvalidInput("hierarchy: landmark " + name + " is not on the base mesh");
}

}  // namespace

RefinementCriterion bent_length_criterion(double bend_weight) {
  if (!(bend_weight >= 0)) throw InvalidInput("refinement: the bend weight must not be negative");
  return [bend_weight](const BaseEdge& e) { return e.length * (1 + bend_weight * std::abs(e.bend)); };
}

void refine_to(FourEightMesh& mesh, int target_vertices, const RefinementCriterion& criterion) {
  if (target_vertices < mesh.vertex_count())
    throw InvalidInput("refinement: " + std::to_string(target_vertices) + " vertices wanted, the mesh already has " +
                       std::to_string(mesh.vertex_count()));
  Refiner(mesh, target_vertices, criterion).run();
}

MultiresTemplate build_hierarchy(const Mesh& base, const std::vector<int>& mirror, const LandmarkSet& landmarks,
                                 const std::vector<int>& budgets, const HierarchyOptions& options) {
  check(base, landmarks, budgets, options);
  MultiresTemplate result;
  result.landmarks = landmarks;
  result.levels.push_back({static_cast<int>(base.vertex_count()), base.F});
  result.V = base.V;
  result.mirror = mirror;
  if (budgets.empty()) return result;
  FourEightMesh mesh = first_level(base, mirror, budgets.front(), options);
  result.levels.push_back({mesh.vertex_count(), mesh.faces()});
  if (options.first_level_positions.rows() > 0) mesh.set_positions(options.first_level_positions);
  for (size_t i = 1; i < budgets.size(); ++i) {
    refine_to(mesh, budgets[i], options.criterion);
    result.levels.push_back({mesh.vertex_count(), mesh.faces()});
  }
  result.parents = mesh.parents();
  result.mirror = mesh.mirror();
  result.V = refine_field(result.parents, mesh.base_count(), base.V, mesh.vertex_count());
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
