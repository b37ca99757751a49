// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/subdivision/refinement.h"

#include <algorithm>
#include <cmath>
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
  Refiner(FourEightMesh& mesh, const RefinementTarget& target, const RefinementCriterion& criterion)
      : mesh_(mesh), target_(target), criterion_(criterion), first_count_(mesh.vertex_count()) {
    if (paced()) border_wanted_ = target.boundary_edges - boundary_edge_count(mesh.faces());
    if (paced() && border_wanted_ < 0)
      throw InvalidInput("refinement: " + std::to_string(target.boundary_edges) +
                         " boundary edges wanted, the mesh already has " +
                         std::to_string(target.boundary_edges - border_wanted_));
    for (int t = 0; t < mesh.face_count(); ++t) push(t);
  }

  void run() {
    const auto fits = [&](int, int cost) { return cost <= missing(); };
    while (missing() > kTail) {
      if (paced() && border_due() > border_done_ && step(border_, fits)) continue;
      must(step(interior_, fits));
    }
    while (border_done_ < border_wanted_) must(step(border_, fits));
    const bool symmetric = !mesh_.mirror().empty();
    // Only a bisection on the midline adds an odd number. If all midline edges are sides, a neighbour makes one a base.
    const auto odd = [&](int, int cost) { return cost % 2 && cost <= missing(); };
    const auto beside_midline = [&](int t, int cost) { return cost < missing() && touches_midline(t); };
    while (symmetric && missing() % 2 && !step(interior_, odd)) must(step(interior_, beside_midline));
    const auto even = [&](int, int cost) { return cost <= missing() && (!symmetric || cost % 2 == 0); };
    while (missing() > 0) must(step(interior_, even));
  }

 private:
  using Queue = std::priority_queue<Candidate>;

  bool paced() const { return target_.boundary_edges >= 0; }
  int missing() const { return target_.vertices - mesh_.vertex_count(); }

  // Boundary edges that should have come into being by now, so that the border keeps pace and is done before the tail.
  double border_due() const {
    const double all = std::max(1, target_.vertices - first_count_ - 2 * kTail);
    return border_wanted_ * std::min(1.0, (mesh_.vertex_count() - first_count_) / all);
  }

  void push(int t) {
    const bool border = paced() && mesh_.on_border(t);
    (border ? border_ : interior_).push({criterion_(mesh_, t), t, mesh_.apex(t)});
  }

  bool touches_midline(int t) const {
    const BaseEdge e = mesh_.base_edge(t);
    const auto own = [&](int v) { return mesh_.mirror()[v] == v; };
    return own(e.apex) && (own(e.a) || own(e.b));
  }

  // A bisection may have to split the border too: more than is wanted, or sooner than its pace, is not allowed.
  bool border_allows(int t, bool interior) const {
    if (!paced()) return true;
    const int more = mesh_.boundary_cost(t);
    return more == 0 || (border_done_ + more <= border_wanted_ && (!interior || border_done_ + more <= border_due()));
  }

  // Bisects the first candidate that is acceptable, given its cost; those passed over stay candidates. Those that the
  // border forbids wait until it has been split somewhere.
  template <class Acceptable>
  bool step(Queue& queue, const Acceptable& acceptable) {
    std::vector<Candidate> passed;
    bool done = false;
    while (!done && !queue.empty()) {
      const Candidate c = queue.top();
      queue.pop();
      if (mesh_.apex(c.triangle) != c.apex) continue;
      if (!border_allows(c.triangle, &queue == &interior_)) {
        (&queue == &interior_ ? waiting_ : passed).push_back(c);
      } else if (acceptable(c.triangle, mesh_.cost(c.triangle))) {
        bisect(c.triangle);
        done = true;
      } else {
        passed.push_back(c);
      }
    }
    for (const Candidate& p : passed) queue.push(p);
    return done;
  }

  void bisect(int t) {
    const int border = paced() ? mesh_.boundary_cost(t) : 0;
    for (const int changed : mesh_.bisect(t).changed) push(changed);
    if (border == 0) return;
    border_done_ += border;
    for (const Candidate& c : waiting_) interior_.push(c);
    waiting_.clear();
  }

  void must(bool done) const {
    if (done) return;
    throw InvalidInput("refinement: " + std::to_string(target_.vertices) + " vertices" +
                       (paced() ? " with " + std::to_string(target_.boundary_edges) + " boundary edges" : "") +
                       " cannot be hit, " + std::to_string(mesh_.vertex_count()) + " is the nearest below" +
                       (mesh_.mirror().empty() ? "" : "; without symmetry it would do"));
  }

  FourEightMesh& mesh_;
  const RefinementTarget target_;
  const RefinementCriterion& criterion_;
  int first_count_, border_wanted_ = 0, border_done_ = 0;
  Queue interior_, border_;
  std::vector<Candidate> waiting_;
};

}  // namespace

RefinementCriterion bent_length_criterion(double bend_weight) {
  if (!(bend_weight >= 0)) throw InvalidInput("refinement: the bend weight must not be negative");
  return [bend_weight](const FourEightMesh& mesh, int t) {
    const BaseEdge e = mesh.base_edge(t);
    return e.length * (1 + bend_weight * std::abs(e.bend));
  };
}

void refine_to(FourEightMesh& mesh, const RefinementTarget& target, const RefinementCriterion& criterion) {
  if (target.vertices < mesh.vertex_count())
    throw InvalidInput("refinement: " + std::to_string(target.vertices) + " vertices wanted, the mesh already has " +
                       std::to_string(mesh.vertex_count()));
  Refiner(mesh, target, criterion).run();
}

}  // namespace facewright
