// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/subdivision/four_eight_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"

namespace facewright {
namespace {

void check_orientation(const Faces& F) {
  std::set<std::pair<int, int>> seen;
  for (int f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      const int a = F(f, k), b = F(f, (k + 1) % 3);
      if (a == b) throw InvalidInput("4-8 mesh: triangle " + std::to_string(f) + " repeats a vertex");
      if (!seen.emplace(a, b).second)
        throw InvalidInput("4-8 mesh: the triangles at edge " + std::to_string(a) + "-" + std::to_string(b) +
                           " are not consistently oriented, or more than two");
    }
}

// The corner of triangle f that is neither a nor b.
int third_corner(const Faces& F, int f, int a, int b) {
  for (int k = 0; k < 3; ++k)
    if (F(f, k) != a && F(f, k) != b) return F(f, k);
  return -1;
}

bool has_half_edge(const Faces& F, int f, int a, int b) {
  for (int k = 0; k < 3; ++k)
    if (F(f, k) == a && F(f, (k + 1) % 3) == b) return true;
  return false;
}

}  // namespace

FourEightMesh::FourEightMesh(const Vertices& V, const Faces& F, const std::vector<int>& mirror,
                             const TrianglePairing& pairing)
    : base_count_(static_cast<int>(V.rows())), mirror_(mirror) {
  check_orientation(F);
  if (2 * pairing.pairs + pairing.singles != F.rows())
    throw InvalidInput("4-8 mesh: the pairing covers " + std::to_string(2 * pairing.pairs + pairing.singles) + " of " +
                       std::to_string(F.rows()) + " triangles");
  for (int v = 0; v < V.rows(); ++v) positions_.push_back(V.row(v));
  for (const TriangleBlock& block : pairing.blocks) add_block(F, block);
  if (!mirror.empty()) {
    const std::vector<int> image = mirrored_triangles(F, mirror);
    std::vector<int> centre(static_cast<size_t>(F.rows()));
    for (size_t i = 0; i < pairing.blocks.size(); ++i)
      for (const int f : {pairing.blocks[i].f, pairing.blocks[i].g})
        if (f >= 0) centre[f] = base_count_ + static_cast<int>(i);
    for (const TriangleBlock& block : pairing.blocks) mirror_.push_back(centre[image[block.f]]);
  }
  connect();
  set_positions(positions());
}

// The triangles around the centre of a block; each has an old edge as its base.
void FourEightMesh::add_block(const Faces& F, const TriangleBlock& block) {
  if (!block.is_pair()) {
    const int a = F(block.f, 0), b = F(block.f, 1), c = F(block.f, 2);
    const int m = add_vertex({a, b, c});
    corners_.insert(corners_.end(), {Triple{m, a, b}, Triple{m, b, c}, Triple{m, c, a}});
    return;
  }
  const bool forward = has_half_edge(F, block.f, block.a, block.b);
  const int left = forward ? block.f : block.g, right = forward ? block.g : block.f;
  const int a = block.a, b = block.b, c = third_corner(F, left, a, b), d = third_corner(F, right, a, b);
  const int m = add_vertex({a, b, -1});
  corners_.insert(corners_.end(), {Triple{m, c, a}, Triple{m, b, c}, Triple{m, d, b}, Triple{m, a, d}});
}

int FourEightMesh::add_vertex(const VertexParents& p) {
  positions_.push_back(p.is_midpoint() ? Eigen::Vector3d(0.5 * (positions_[p.a] + positions_[p.b]))
                                       : Eigen::Vector3d((positions_[p.a] + positions_[p.b] + positions_[p.c]) / 3));
  if (!normals_.empty()) normals_.push_back((normals_[p.a] + normals_[p.b]).normalized());
  parents_.push_back(p);
  return vertex_count() - 1;
}

void FourEightMesh::connect() {
  const Faces F = faces(), across = face_neighbours(F);
  opposite_.resize(corners_.size());
  for (int t = 0; t < face_count(); ++t)
    for (int k = 0; k < 3; ++k) opposite_[t][k] = across(t, (k + 1) % 3);
  if (!mirror_.empty()) twin_ = mirrored_triangles(F, mirror_);
}

Vertices FourEightMesh::positions() const {
  Vertices V(vertex_count(), 3);
  for (int v = 0; v < vertex_count(); ++v) V.row(v) = positions_[v];
  return V;
}

Faces FourEightMesh::faces() const {
  Faces F(face_count(), 3);
  for (int t = 0; t < face_count(); ++t) F.row(t) << corners_[t][0], corners_[t][1], corners_[t][2];
  return F;
}

void FourEightMesh::set_positions(const Vertices& V) {
  if (V.rows() != vertex_count())
    throw InvalidInput("4-8 mesh: " + std::to_string(V.rows()) + " positions for " + std::to_string(vertex_count()) +
                       " vertices");
  for (int v = 0; v < vertex_count(); ++v) positions_[v] = V.row(v);
  normals_.assign(positions_.size(), Eigen::Vector3d::Zero());
  for (const Triple& t : corners_) {
    const Eigen::Vector3d n =
        (positions_[t[1]] - positions_[t[0]]).cross(positions_[t[2]] - positions_[t[0]]);  // twice the area
    for (const int v : t) normals_[v] += n;
  }
  for (auto& n : normals_) n.normalize();
}

BaseEdge FourEightMesh::base_edge(int t) const {
  const Triple& c = corners_.at(static_cast<size_t>(t));
  BaseEdge e{c[1], c[2], c[0], -1, (positions_[c[1]] - positions_[c[2]]).norm(), 0};
  const int s = opposite_[t][0];
  if (s < 0) return e;
  for (const int v : corners_[s])
    if (v != e.a && v != e.b) e.opposite = v;
  // Normals of the smooth surface, not of the flat triangles: bisected flat triangles would have no bend at all.
  const Eigen::Vector3d shared = normals_[e.a] + normals_[e.b];
  const Eigen::Vector3d n = shared + normals_[e.apex], m = shared + normals_[e.opposite];
  e.bend = std::atan2(n.cross(m).norm(), n.dot(m));
  return e;
}

double FourEightMesh::base_area(int t) const {
  const auto area = [&](const Triple& c) {
    return 0.5 * (positions_[c[1]] - positions_[c[0]]).cross(positions_[c[2]] - positions_[c[0]]).norm();
  };
  const int s = opposite_.at(static_cast<size_t>(t))[0];
  return area(corners_[t]) + (s < 0 ? 0 : area(corners_[s]));
}

int FourEightMesh::cost(int t) const {
  for (int sum = 0;; t = opposite_[t][0]) {
    const bool last = compatible(t);
    sum += twin_.empty() || (last && is_own_image(t)) ? 1 : 2;
    if (last) return sum;
  }
}

int FourEightMesh::last_of_chain(int t) const {
  while (!compatible(t)) t = opposite_[t][0];
  return t;
}

int FourEightMesh::boundary_cost(int t) const {
  const int last = last_of_chain(t);
  if (!on_border(last)) return 0;
  return twin_.empty() || is_own_image(last) ? 1 : 2;
}

FourEightMesh::Bisection FourEightMesh::bisect(int t) {
  if (t < 0 || t >= face_count()) throw InvalidInput("4-8 mesh: no triangle " + std::to_string(t));
  Bisection done;
  std::vector<int> chain{t};  // ever coarser triangles, each in the way of the one before
  while (!chain.empty()) {
    if (compatible(chain.back())) {
      split(chain.back(), done);
      chain.pop_back();
    } else {
      chain.push_back(opposite_[chain.back()][0]);
    }
  }
  return done;
}

void FourEightMesh::split(int t, Bisection& done) {
  const auto note = [&](const std::array<int, 4>& triangles) {
    ++done.vertices;
    for (const int x : triangles)
      if (x >= 0) done.changed.push_back(x);
  };
  if (twin_.empty()) return note(split_pair(t));
  const int image = is_own_image(t) ? -1 : twin_[t];
  const auto these = split_pair(t);
  mirror_.push_back(vertex_count() - 1);
  note(these);
  if (image < 0) return match_twins(these, these);
  const auto images = split_pair(image);
  mirror_.back() = vertex_count() - 1;
  mirror_.push_back(vertex_count() - 2);
  note(images);
  match_twins(these, images);
}

// Splits the base of t, in t and in its neighbour, the one with the lower number first, so that the order of the
// triangles follows from the journal alone; returns the two to four triangles (-1 for the missing ones).
std::array<int, 4> FourEightMesh::split_pair(int t) {
  int s = opposite_[t][0];
  if (s >= 0 && s < t) std::swap(s, t);
  const int m = add_vertex({std::min(corners_[t][1], corners_[t][2]), std::max(corners_[t][1], corners_[t][2]), -1});
  const int t2 = add_half(t, m);
  if (s < 0) return {t, t2, -1, -1};
  const int s2 = add_half(s, m);
  opposite_[t][1] = s2;  // across (m, a): t = (m, p, a), s2 = (m, a, q)
  opposite_[s2][2] = t;
  opposite_[t2][2] = s;  // across (m, b): t2 = (m, b, p), s = (m, q, b)
  opposite_[s][1] = t2;
  return {t, t2, s, s2};
}

// t = (p, a, b) becomes (m, p, a), the new triangle is (m, b, p).
int FourEightMesh::add_half(int t, int m) {
  const auto [p, a, b] = corners_[t];
  const auto [base, across_bp, across_pa] = opposite_[t];
  const int t2 = face_count();
  corners_[t] = {m, p, a};
  opposite_[t] = {across_pa, -1, t2};
  corners_.push_back({m, b, p});
  opposite_.push_back({across_bp, t, -1});
  if (across_bp >= 0) redirect(across_bp, t, t2);
  if (!twin_.empty()) twin_.push_back(-1);
  return t2;
}

void FourEightMesh::redirect(int t, int from, int to) {
  for (int& n : opposite_[t])
    if (n == from) n = to;
}

void FourEightMesh::match_twins(const std::array<int, 4>& these, const std::array<int, 4>& images) {
  for (const int t : these) {
    if (t < 0) continue;
    const Triple reflected{mirror_[corners_[t][0]], mirror_[corners_[t][2]], mirror_[corners_[t][1]]};
    for (const int s : images)
      if (s >= 0 && corners_[s] == reflected) {
        twin_[t] = s;
        twin_[s] = t;
      }
  }
}

void FourEightMesh::uniform_step() {
  const int old = vertex_count(), count = face_count();
  for (int t = 0; t < count; ++t)
    if (apex(t) < old) bisect(t);
}

}  // namespace facewright
