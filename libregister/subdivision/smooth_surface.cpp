// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/subdivision/smooth_surface.h"

#include <map>
#include <set>
#include <utility>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libregister/subdivision/four_eight_mesh.h"

namespace facewright {
namespace {

using EdgeKey = std::pair<int, int>;

EdgeKey key_of(int a, int b) { return std::minmax(a, b); }

// One step's rules on a mesh whose diagonals, the edges to be split, are known.
class SmoothingStep {
 public:
  SmoothingStep(const Vertices& V, const Faces& F, const std::set<EdgeKey>& diagonals) : V_(V), edges_(edges(F)) {
    for (const Edge& e : edges_) {
      const bool split = diagonals.count({e.v0, e.v1}) > 0;
      if (split) facing_[{e.v0, e.v1}] = {across(F, e.f0, e), e.is_boundary() ? -1 : across(F, e.f1, e)};
    }
  }

  Vertices moved() const {
    const auto n = static_cast<size_t>(V_.rows());
    Vertices sum = Vertices::Zero(V_.rows(), 3), border_sum = sum;
    std::vector<int> count(n, 0), border(n, 0), border_split(n, 0);
    for (const Edge& e : edges_)
      for (const auto& [v, other] : {EdgeKey{e.v0, e.v1}, EdgeKey{e.v1, e.v0}}) {
        const bool split = facing_.count({e.v0, e.v1}) > 0;
        if (!split) sum.row(v) += V_.row(other), ++count[static_cast<size_t>(v)];
        if (!e.is_boundary()) continue;
        border_sum.row(v) += V_.row(other);
        ++border[static_cast<size_t>(v)];
        border_split[static_cast<size_t>(v)] += split;
      }
    Vertices result = V_;
    for (Eigen::Index v = 0; v < V_.rows(); ++v) {
      const auto i = static_cast<size_t>(v);
      if (border[i] == 2 && border_split[i] == 2)
        result.row(v) = 0.75 * V_.row(v) + 0.125 * border_sum.row(v);
      else if (border[i] == 0 && count[i] > 0)
        result.row(v) = 0.5 * V_.row(v) + sum.row(v) / (2.0 * count[i]);
    }
    return result;
  }

  Eigen::RowVector3d centre(const VertexParents& p) const {
    if (!p.is_midpoint()) return (V_.row(p.a) + V_.row(p.b) + V_.row(p.c)) / 3;
    const Eigen::RowVector3d ends = V_.row(p.a) + V_.row(p.b);
    const auto [c, d] = facing_.at(key_of(p.a, p.b));
    return d < 0 ? Eigen::RowVector3d(ends / 2) : Eigen::RowVector3d((ends + V_.row(c) + V_.row(d)) / 4);
  }

 private:
  static int across(const Faces& F, int f, const Edge& e) { return F(f, 0) + F(f, 1) + F(f, 2) - e.v0 - e.v1; }

  const Vertices& V_;
  std::vector<Edge> edges_;
  std::map<EdgeKey, EdgeKey> facing_;  // split edge -> the corners facing it, -1 on a border
};

// Old vertices by the vertex rules, then the new ones that the journal has from row `first` on.
Vertices stepped(const Vertices& V, const Faces& F, const std::set<EdgeKey>& diagonals,
                 const std::vector<VertexParents>& parents, size_t first) {
  const SmoothingStep step(V, F, diagonals);
  Vertices result(V.rows() + static_cast<Eigen::Index>(parents.size() - first), 3);
  result.topRows(V.rows()) = step.moved();
  for (size_t i = first; i < parents.size(); ++i)
    result.row(V.rows() + static_cast<Eigen::Index>(i - first)) = step.centre(parents[i]);
  return result;
}

std::set<EdgeKey> bases(const Faces& F) {
  std::set<EdgeKey> result;
  for (Eigen::Index t = 0; t < F.rows(); ++t) result.insert(key_of(F(t, 1), F(t, 2)));
  return result;
}

}  // namespace

SmoothSurface smooth_surface(const Mesh& base, int steps, const std::vector<int>& mirror) {
  validate(base);
  if (steps < 0) throw InvalidInput("smooth surface: the number of steps must not be negative");
  if (steps == 0) return {base.V, base.F, mirror};
  const TrianglePairing pairing = pair_triangles(base.V, base.F, mirror);
  FourEightMesh mesh(base.V, base.F, mirror, pairing);
  std::set<EdgeKey> diagonals;
  for (const TriangleBlock& b : pairing.blocks)
    if (b.is_pair()) diagonals.insert(key_of(b.a, b.b));
  Vertices V = stepped(base.V, base.F, diagonals, mesh.parents(), 0);
  for (int step = 1; step < steps; ++step) {
    const Faces F = mesh.faces();
    const size_t known = mesh.parents().size();
    mesh.uniform_step();
    V = stepped(V, F, bases(F), mesh.parents(), known);
  }
  return {V, mesh.faces(), mesh.mirror()};
}

}  // namespace facewright
