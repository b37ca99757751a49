// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "tools/default_reference/half_face_relaxation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "libmodel/core/random.h"

namespace facewright::face_design {
namespace {

using Pair = std::pair<int, int>;
Pair key(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

class Relaxer {
 public:
  Relaxer(HalfFaceMesh& mesh, const HalfFaceDesign& design, const WantedLength& wanted)
      : m_(mesh), wanted_(wanted), immovable_(mesh.points.size(), false) {
    for (const auto& [a, b] : design.segments) fixed_.insert(key(a, b));
    for (const auto& [name, v] : design.landmarks) immovable_[v] = true;
    for (const int v : design.outline) immovable_[v] = immovable_[v] || !design.midline[v];
  }

  void run() {
    for (int round = 0; round < 60; ++round) {
      for (int i = 0; i < 10 && flip_pass(); ++i) {
      }
      find_rings();
      move_to_centroids();
    }
    for (int round = 0; round < 25; ++round) {
      while (flip_pass()) {
      }
      find_rings();
      improve_worst(round);
    }
    for (int round = 0; round < 40; ++round) open_folds(round);
  }

 private:
  const Vector3d& at(int v) const { return m_.points[v]; }
  int count() const { return static_cast<int>(m_.points.size()); }

  static double angle(const Vector3d& apex, const Vector3d& a, const Vector3d& b) {
    return std::atan2((a - apex).cross(b - apex).norm(), (a - apex).dot(b - apex));
  }

  double facing(int a, int b, int c) const {
    const Vector3d n = (at(b) - at(a)).cross(at(c) - at(a)).normalized();
    return n.dot(normal((at(a) + at(b) + at(c)) / 3));
  }

  // How good a triangle is: its shape, and that it faces as the surface below it does.
  double merit(int a, int b, int c) const {
    return triangle_quality(at(a), at(b), at(c)) * std::min(1.0, std::max(facing(a, b, c), -1.0) + 0.25);
  }

  bool flip_pass() {
    std::map<Pair, std::vector<int>> edges;
    for (int t = 0; t < static_cast<int>(m_.triangles.size()); ++t)
      for (int k = 0; k < 3; ++k) edges[key(m_.triangles[t][k], m_.triangles[t][(k + 1) % 3])].push_back(t);
    bool changed = false;
    std::set<int> touched;
    std::vector<Pair> order;
    for (const auto& e : edges) order.push_back(e.first);
    for (const auto& e : order) {
      const auto& faces = edges[e];
      if (faces.size() != 2 || fixed_.count(e) || touched.count(faces[0]) || touched.count(faces[1])) continue;
      if (flip(e, faces[0], faces[1], edges)) {
        touched.insert({faces[0], faces[1]});
        changed = true;
      }
    }
    return changed;
  }

  bool flip(const Pair& e, int f, int g, std::map<Pair, std::vector<int>>& edges) {
    auto& tf = m_.triangles[f];
    auto& tg = m_.triangles[g];
    const int k = static_cast<int>(
        std::find_if(tf.begin(), tf.end(), [&](int v) { return v != e.first && v != e.second; }) - tf.begin());
    const int p = tf[k], a = tf[(k + 1) % 3], b = tf[(k + 2) % 3];
    const int q = *std::find_if(tg.begin(), tg.end(), [&](int v) { return v != a && v != b; });
    if (edges.count(key(p, q)) && !edges[key(p, q)].empty()) return false;
    if (angle(at(p), at(a), at(b)) + angle(at(q), at(a), at(b)) <= M_PI + 1e-6) return false;
    const double before = std::min(facing(p, a, b), facing(q, b, a)),
                 after = std::min(facing(p, a, q), facing(p, q, b));
    if (after < 0.4 && after < before) return false;
    if (triangle_quality(at(p), at(a), at(q)) < 0.05 || triangle_quality(at(p), at(q), at(b)) < 0.05) return false;
    tf = {p, a, q};
    tg = {p, q, b};
    edges[e].clear();
    edges[key(p, q)] = {f, g};
    return true;
  }

  void find_rings() {
    ring_.assign(m_.points.size(), {});
    for (int t = 0; t < static_cast<int>(m_.triangles.size()); ++t)
      for (const int v : m_.triangles[t]) ring_[v].push_back(t);
  }

  void put(int v, Vector3d p) {
    if (m_.midline[v]) p.x() = 0;
    p = project(p);
    if (m_.midline[v]) p.x() = 0;
    m_.points[v] = p;
  }

  double worst(int v) const {
    double w = 1;
    for (const int t : ring_[v]) w = std::min(w, merit(m_.triangles[t][0], m_.triangles[t][1], m_.triangles[t][2]));
    return w;
  }

  void move_to_centroids() {
    for (int v = 0; v < count(); ++v) {
      if (m_.pinned[v]) continue;
      Vector3d sum = Vector3d::Zero();
      double weight = 0;
      for (const int t : ring_[v]) {
        const auto& [a, b, c] = m_.triangles[t];
        const Vector3d middle = (at(a) + at(b) + at(c)) / 3;
        const double w = (at(b) - at(a)).cross(at(c) - at(a)).norm() / std::pow(wanted_(middle), 4);
        sum += w * middle;
        weight += w;
      }
      const Vector3d old = at(v), n = normal(old);
      Vector3d step = 0.7 * (sum / weight - old);
      step -= n * n.dot(step);
      const double before = worst(v);
      put(v, old + step);
      if (const double after = worst(v); after < 0.15 && after < before) m_.points[v] = old;
    }
  }

  // Tries a few tangential steps for the points of poor triangles and keeps what makes the worst of the ring better.
  void improve_worst(int round) {
    Random random(static_cast<std::uint64_t>(round));
    const double reach = 0.3 / (1 + 0.2 * round);
    for (int v = 0; v < count(); ++v) {
      if (m_.pinned[v]) continue;
      double best = worst(v);
      if (best > 0.85) continue;
      const double length = wanted_(at(v));
      for (int trial = 0; trial < 8; ++trial) {
        const Vector3d old = at(v);
        put(v, old + reach * length * Vector3d(random.normal(), random.normal(), random.normal()));
        if (const double w = worst(v); w > best)
          best = w;
        else
          m_.points[v] = old;
      }
    }
  }

  Vector3d face_normal(int t) const {
    const auto& [a, b, c] = m_.triangles[t];
    return (at(b) - at(a)).cross(at(c) - at(a)).normalized();
  }

  // Sharpest fold at the edges of the triangles around v, radians; edges on the midline fold with their mirror image.
  double sharpest_fold(int v) const {
    double sharpest = 0;
    for (const int t : ring_[v])
      for (int k = 0; k < 3; ++k) {
        const int a = m_.triangles[t][k], b = m_.triangles[t][(k + 1) % 3];
        const Vector3d n = face_normal(t);
        if (m_.midline[a] && m_.midline[b]) {
          sharpest = std::max(sharpest, std::acos(std::clamp(1 - 2 * n.x() * n.x(), -1.0, 1.0)));
          continue;
        }
        for (const int s : ring_[a])
          if (s != t && std::find(m_.triangles[s].begin(), m_.triangles[s].end(), b) != m_.triangles[s].end())
            sharpest = std::max(sharpest, std::acos(std::clamp(n.dot(face_normal(s)), -1.0, 1.0)));
      }
    return sharpest;
  }

  double worst_shape(int v) const {
    double w = 1;
    for (const int t : ring_[v])
      w = std::min(w, triangle_quality(at(m_.triangles[t][0]), at(m_.triangles[t][1]), at(m_.triangles[t][2])));
    return w;
  }

  void open_folds(int round) {
    constexpr double allowed = 72 * M_PI / 180, off_surface = 1.0, least_shape = 0.5;
    Random random(1000 + static_cast<std::uint64_t>(round));
    for (int v = 0; v < count(); ++v) {
      if (immovable_[v]) continue;
      double best = sharpest_fold(v);
      for (int trial = 0; trial < 12 && best > allowed; ++trial) {
        const Vector3d old = at(v);
        const double shape = worst_shape(v);
        Vector3d p = old + 0.4 * Vector3d(random.normal(), random.normal(), random.normal());
        if (m_.midline[v]) p.x() = 0;
        m_.points[v] = p;
        const double fold = sharpest_fold(v);
        if (fold < best && std::abs(distance(p)) < off_surface && worst_shape(v) > std::min(shape, least_shape))
          best = fold;
        else
          m_.points[v] = old;
      }
    }
  }

  HalfFaceMesh& m_;
  const WantedLength& wanted_;
  std::vector<bool> immovable_;  // landmarks and the outline
  std::set<Pair> fixed_;
  std::vector<std::vector<int>> ring_;
};

}  // namespace

double triangle_quality(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const double squares = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
  return 2 * std::sqrt(3.0) * (b - a).cross(c - a).norm() / squares;
}

void relax(HalfFaceMesh& mesh, const HalfFaceDesign& design, const WantedLength& wanted) {
  Relaxer(mesh, design, wanted).run();
}

}  // namespace facewright::face_design
