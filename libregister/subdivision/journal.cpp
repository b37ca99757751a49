// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/subdivision/journal.h"

#include <algorithm>
#include <array>
#include <map>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libregister/subdivision/four_eight_mesh.h"

namespace facewright {
namespace {

[[noreturn]] void refuse(int vertex) {
  throw InvalidInput("journal: vertex " + std::to_string(vertex) + " cannot be made on this base mesh");
}

// The blocks of the first step, from the first entries of the journal.
TrianglePairing pairing_of(const RefinementJournal& journal, const Faces& F) {
  std::map<std::pair<int, int>, Edge> edge_at;
  for (const Edge& e : edges(F)) edge_at.emplace(std::pair(e.v0, e.v1), e);
  std::map<std::array<int, 3>, int> face_at;
  for (int f = 0; f < F.rows(); ++f) face_at[{F(f, 0), F(f, 1), F(f, 2)}] = f;
  TrianglePairing pairing;
  for (size_t i = 0; 2 * pairing.pairs + pairing.singles < F.rows(); ++i) {
    const int vertex = journal.base_count + static_cast<int>(i);
    if (i == journal.parents.size()) refuse(vertex);
    const VertexParents& p = journal.parents[i];
    if (p.is_midpoint()) {
      const auto e = edge_at.find({p.a, p.b});
      if (e == edge_at.end() || e->second.is_boundary()) refuse(vertex);
      pairing.blocks.push_back({e->second.f0, e->second.f1, p.a, p.b});
      ++pairing.pairs;
    } else {
      const auto f = face_at.find({p.a, p.b, p.c});
      if (f == face_at.end()) refuse(vertex);
      pairing.blocks.push_back({f->second, -1, -1, -1});
      ++pairing.singles;
    }
  }
  return pairing;
}

// Makes the bisections of the journal one after the other.
class Replay {
 public:
  Replay(const RefinementJournal& journal, const Mesh& base)
      : journal_(journal), mesh_(base.V, base.F, {}, pairing_of(journal, base.F)) {
    for (int t = 0; t < mesh_.face_count(); ++t) note(t);
  }

  Faces faces_at(int vertices) {
    while (mesh_.vertex_count() < vertices) bisect(mesh_.vertex_count());
    if (mesh_.vertex_count() != vertices) refuse(vertices);
    return mesh_.faces();
  }

 private:
  void note(int t) {
    const BaseEdge e = mesh_.base_edge(t);
    triangle_at_[std::minmax(e.a, e.b)] = t;
  }

  void bisect(int vertex) {
    const VertexParents& p = journal_.parents[static_cast<size_t>(vertex - journal_.base_count)];
    const auto t = triangle_at_.find(std::minmax(p.a, p.b));
    if (!p.is_midpoint() || t == triangle_at_.end() || mesh_.cost(t->second) != 1) refuse(vertex);
    const int triangle = t->second;
    triangle_at_.erase(t);
    for (const int changed : mesh_.bisect(triangle).changed) note(changed);
  }

  const RefinementJournal& journal_;
  FourEightMesh mesh_;
  std::map<std::pair<int, int>, int> triangle_at_;  // by base edge
};

// Images of the new vertices: parents map to parents.
std::vector<int> carried_mirror(const RefinementJournal& journal, std::vector<int> mirror) {
  if (mirror.empty()) return {};
  const auto key = [](int a, int b, int c) {
    std::array<int, 3> k{a, b, c};
    std::sort(k.begin(), k.end());
    return k;
  };
  std::map<std::array<int, 3>, int> child;
  for (size_t i = 0; i < journal.parents.size(); ++i) {
    const VertexParents& p = journal.parents[i];
    child[key(p.a, p.b, p.c)] = journal.base_count + static_cast<int>(i);
  }
  for (const VertexParents& p : journal.parents) {
    const auto at = [&](int v) { return v < 0 ? -1 : mirror.at(static_cast<size_t>(v)); };
    const auto image = child.find(key(at(p.a), at(p.b), at(p.c)));
    if (image == child.end()) refuse(static_cast<int>(mirror.size()));
    mirror.push_back(image->second);
  }
  return mirror;
}

}  // namespace

RefinementJournal journal_of(const MultiresTemplate& reference) { return {reference.base_count(), reference.parents}; }

Eigen::MatrixXd carry_up(const RefinementJournal& journal, const Eigen::MatrixXd& field, int vertices) {
  return refine_field(journal.parents, journal.base_count, field, vertices);
}

Eigen::MatrixXd truncate_to(const RefinementJournal& journal, const Eigen::MatrixXd& field, int vertices) {
  if (vertices < journal.base_count || vertices > field.rows() || field.rows() > journal.vertex_count())
    throw InvalidInput("journal: cannot truncate a field of " + std::to_string(field.rows()) + " rows to " +
                       std::to_string(vertices) + " vertices; the base has " + std::to_string(journal.base_count) +
                       ", the journal " + std::to_string(journal.vertex_count()));
  return field.topRows(vertices);
}

MultiresTemplate replay(const RefinementJournal& journal, const Mesh& base, const std::vector<int>& mirror,
                        const LandmarkSet& landmarks, const std::vector<int>& level_counts) {
  validate(base);
  if (journal.base_count != base.vertex_count())
    throw InvalidInput("journal: made on " + std::to_string(journal.base_count) + " vertices, the base mesh has " +
                       std::to_string(base.vertex_count()));
  if (level_counts.empty() || level_counts.front() != journal.base_count ||
      level_counts.back() != journal.vertex_count() || !std::is_sorted(level_counts.begin(), level_counts.end()))
    throw InvalidInput("journal: the levels must lead from the base to the end");
  for (size_t i = 0; i < journal.parents.size(); ++i) {
    const VertexParents& p = journal.parents[i];
    const int v = journal.base_count + static_cast<int>(i);
    if (std::min(p.a, p.b) < 0 || std::max({p.a, p.b, p.c}) >= v) refuse(v);
  }
  MultiresTemplate result;
  result.landmarks = landmarks;
  result.levels.push_back({journal.base_count, base.F});
  if (level_counts.size() > 1) {
    Replay mesh(journal, base);
    for (size_t l = 1; l < level_counts.size(); ++l)
      result.levels.push_back({level_counts[l], mesh.faces_at(level_counts[l])});
  }
  result.parents = journal.parents;
  result.mirror = carried_mirror(journal, mirror);
  result.V = carry_up(journal, base.V, journal.vertex_count());
  return result;
}

}  // namespace facewright
