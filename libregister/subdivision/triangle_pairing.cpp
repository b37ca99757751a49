// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/subdivision/triangle_pairing.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"

namespace facewright {
namespace {

using Triple = std::array<int, 3>;

// The same triangle, starting at its smallest vertex.
Triple canonical(Triple t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

void check_involution(const Faces& F, const std::vector<int>& mirror) {
  const int n = static_cast<int>(mirror.size());
  for (int v = 0; v < n; ++v)
    if (mirror[v] < 0 || mirror[v] >= n || mirror[mirror[v]] != v)
      throw InvalidInput("4-8 mesh: the mirror table is not an involution at vertex " + std::to_string(v));
  if (F.size() > 0 && F.maxCoeff() >= n)
    throw InvalidInput("4-8 mesh: the mirror table has " + std::to_string(n) + " rows, but the triangles use vertex " +
                       std::to_string(F.maxCoeff()));
}

// The pairing in the making. Everything is done to an edge and its mirror image together.
class Pairer {
 public:
  Pairer(const Vertices& V, const Faces& F, const std::vector<int>& mirror)
      : edges_(edges(F)),
        mirror_vertex_(mirror),
        mirror_face_(mirror.empty() ? std::vector<int>{} : mirrored_triangles(F, mirror)),
        mate_(static_cast<size_t>(F.rows()), kFree),
        face_edges_(static_cast<size_t>(F.rows()), {-1, -1, -1}) {
    for (int e = 0; e < static_cast<int>(edges_.size()); ++e) {
      for (const int f : {edges_[e].f0, edges_[e].f1})
        if (f >= 0) *std::find(face_edges_[f].begin(), face_edges_[f].end(), -1) = e;
      length_.push_back((V.row(edges_[e].v0) - V.row(edges_[e].v1)).norm());
    }
    for (int e = 0; e < static_cast<int>(edges_.size()); ++e) twin_.push_back(find_twin(e));
    sort_edges();
  }

  void pair_greedily() {
    for (const int e : order_) {
      if (!free(e) || !free(twin_[e]) || (twin_[e] != e && share_face(e, twin_[e]))) continue;
      take(e);
      take(twin_[e]);
    }
    for (int& m : mate_)
      if (m == kFree) m = kSingle;
  }

  int singles() const { return static_cast<int>(std::count(mate_.begin(), mate_.end(), kSingle)); }

  void approach(int wanted) {
    while (singles() < wanted && take_worst_pair_apart(wanted - singles())) {
    }
    while (singles() > wanted && join_singles(singles() - wanted)) {
    }
  }

  TrianglePairing result() const {
    TrianglePairing r;
    std::vector<bool> done(mate_.size(), false);
    const auto add_single = [&](int f) {
      if (done[f] || mate_[f] != kSingle) return;
      r.blocks.push_back({f, -1, -1, -1});
      done[f] = true;
      ++r.singles;
    };
    for (const int e : order_)
      for (const int x : orbit(e)) {
        const Edge& edge = edges_[x];
        if (edge.is_boundary()) {
          add_single(edge.f0);
        } else if (mate_[edge.f0] == edge.f1 && mate_edge(edge.f0) == x) {
          r.blocks.push_back({edge.f0, edge.f1, edge.v0, edge.v1});
          done[edge.f0] = done[edge.f1] = true;
          ++r.pairs;
        }
      }
    for (int f = 0; f < static_cast<int>(mate_.size()); ++f) {
      add_single(f);
      add_single(image(f));
    }
    return r;
  }

 private:
  static constexpr int kFree = -1, kSingle = -2;
  static constexpr int kLongestPath = 10;  // pairs given up: enough on every mesh we met, and the search stays short

  int image(int f) const { return mirror_face_.empty() ? f : mirror_face_[f]; }

  int find_twin(int e) const {
    if (mirror_vertex_.empty()) return e;
    const int a = mirror_vertex_[edges_[e].v0], b = mirror_vertex_[edges_[e].v1];
    const std::pair<int, int> key(std::min(a, b), std::max(a, b));
    const auto it = std::lower_bound(edges_.begin(), edges_.end(), key,
                                     [](const Edge& x, const auto& k) { return std::pair(x.v0, x.v1) < k; });
    return static_cast<int>(it - edges_.begin());  // exists: the triangles map to triangles
  }

  std::vector<int> orbit(int e) const { return twin_[e] == e ? std::vector{e} : std::vector{e, twin_[e]}; }

  // One edge of each mirrored pair, the longest first; a pair is as long as the longer of the two.
  void sort_edges() {
    for (int e = 0; e < static_cast<int>(edges_.size()); ++e)
      if (e <= twin_[e]) order_.push_back(e);
    const auto length = [&](int e) { return std::max(length_[e], length_[twin_[e]]); };
    std::stable_sort(order_.begin(), order_.end(), [&](int a, int b) { return length(a) > length(b); });
  }

  bool free(int e) const {
    const Edge& x = edges_[e];
    return mate_[x.f0] == kFree && (x.is_boundary() || mate_[x.f1] == kFree);
  }

  bool share_face(int e, int d) const {
    const Edge &x = edges_[e], &y = edges_[d];
    return x.f0 == y.f0 || x.f0 == y.f1 || (x.f1 >= 0 && (x.f1 == y.f0 || x.f1 == y.f1));
  }

  void take(int e) {
    const Edge& x = edges_[e];
    mate_[x.f0] = x.is_boundary() ? kSingle : x.f1;
    if (!x.is_boundary()) mate_[x.f1] = x.f0;
  }

  // The edge between a triangle and its mate (the longest, should two triangles share more than one).
  int mate_edge(int f) const {
    int best = -1;
    for (const int e : face_edges_[f]) {
      const Edge& x = edges_[e];
      if (!x.is_boundary() && x.f0 + x.f1 - f == mate_[f] && (best < 0 || length_[e] > length_[best])) best = e;
    }
    return best;
  }

  // Length of the diagonal relative to the other edges of its two triangles: a good block has a long diagonal.
  double quality(int e) const {
    double sum = 0;
    for (const int f : {edges_[e].f0, edges_[e].f1})
      for (const int x : face_edges_[f])
        if (x != e) sum += length_[x];
    return length_[e] / (sum / 4);
  }

  bool take_worst_pair_apart(int missing) {
    int worst = -1;
    const bool need_midline = missing % 4 == 2 && !mirror_face_.empty();
    for (const int e : order_) {
      const Edge& x = edges_[e];
      if (x.is_boundary() || mate_[x.f0] != x.f1 || mate_edge(x.f0) != e) continue;
      const int change = mirror_face_.empty() || twin_[e] == e ? 2 : 4;
      if (change > missing || (need_midline && change != 2)) continue;
      if (worst < 0 || quality(e) < quality(worst)) worst = e;
    }
    if (worst < 0) return false;
    for (const int e : orbit(worst)) mate_[edges_[e].f0] = mate_[edges_[e].f1] = kSingle;
    return true;
  }

  // An augmenting path runs from a single to a single; its edges alternate between neighbours that become pairs and
  // pairs that are given up. `edges` are the former, `faces` all triangles on it.
  struct Path {
    std::vector<int> edges, faces;
    double quality = -1;
    bool passes(int f) const { return std::find(faces.begin(), faces.end(), f) != faces.end(); }
  };

  int across(int e, int f) const { return edges_[e].is_boundary() ? -1 : edges_[e].f0 + edges_[e].f1 - f; }

  // How many singles the path and its image remove, 0 if they get in each other's way.
  int gain(const Path& p) const {
    if (mirror_face_.empty()) return 2;
    if (std::none_of(p.faces.begin(), p.faces.end(), [&](int f) { return p.passes(mirror_face_[f]); })) return 4;
    const auto is_twin = [&](int e, int d) { return twin_[e] == d; };
    return std::equal(p.edges.begin(), p.edges.end(), p.edges.rbegin(), is_twin) ? 2 : 0;
  }

  void consider(Path p, int surplus, Path& best) const {
    const int g = gain(p);
    if (g == 0 || g > surplus || (surplus % 4 == 2 && !mirror_face_.empty() && g != 2)) return;
    p.quality = quality(p.edges.front());
    for (const int e : p.edges) p.quality = std::min(p.quality, quality(e));
    if (p.quality > best.quality) best = p;
  }

  // Goes on from the last triangle of the path through at most `pairs` more pairs.
  void extend(Path& path, int pairs, int surplus, Path& best) const {
    const int from = path.faces.back();
    for (const int e : face_edges_[from]) {
      const int a = across(e, from);
      if (a < 0 || mate_[from] == a || path.passes(a)) continue;
      path.edges.push_back(e);
      path.faces.push_back(a);
      if (mate_[a] == kSingle) {
        consider(path, surplus, best);
      } else if (pairs > 0 && !path.passes(mate_[a])) {
        path.faces.push_back(mate_[a]);
        extend(path, pairs - 1, surplus, best);
        path.faces.pop_back();
      }
      path.faces.pop_back();
      path.edges.pop_back();
    }
  }

  bool join_singles(int surplus) {
    Path best;
    for (int pairs = 0; pairs <= kLongestPath && best.edges.empty(); ++pairs)
      for (int f = 0; f < static_cast<int>(mate_.size()); ++f) {
        if (mate_[f] != kSingle) continue;
        Path path{{}, {f}, -1};
        extend(path, pairs, surplus, best);
      }
    for (const int e : best.edges) {
      take(e);
      take(twin_[e]);
    }
    return !best.edges.empty();
  }

  std::vector<Edge> edges_;
  std::vector<double> length_;
  const std::vector<int>& mirror_vertex_;
  std::vector<int> mirror_face_, twin_, order_;
  std::vector<int> mate_;  // per triangle: its partner, kFree or kSingle
  std::vector<Triple> face_edges_;
};

}  // namespace

std::vector<int> mirrored_triangles(const Faces& F, const std::vector<int>& mirror) {
  check_involution(F, mirror);
  std::map<Triple, int> index;
  for (int f = 0; f < F.rows(); ++f) index[canonical({F(f, 0), F(f, 1), F(f, 2)})] = f;
  std::vector<int> result;
  for (int f = 0; f < F.rows(); ++f) {
    const auto it = index.find(canonical({mirror[F(f, 0)], mirror[F(f, 2)], mirror[F(f, 1)]}));
    if (it == index.end())
      throw InvalidInput("4-8 mesh: triangle " + std::to_string(f) +
                         " has no mirror image; make the triangles symmetric or leave the mirror table out");
    result.push_back(it->second);
  }
  return result;
}

TrianglePairing pair_triangles(const Vertices& V, const Faces& F, const std::vector<int>& mirror, int wanted_singles) {
  if (F.rows() == 0) throw InvalidInput("4-8 mesh: no triangles");
  if (F.minCoeff() < 0 || F.maxCoeff() >= V.rows())
    throw InvalidInput("4-8 mesh: triangle indices outside 0.." + std::to_string(V.rows() - 1));
  if (!mirror.empty() && static_cast<Eigen::Index>(mirror.size()) != V.rows())
    throw InvalidInput("4-8 mesh: " + std::to_string(mirror.size()) + " mirror entries for " +
                       std::to_string(V.rows()) + " vertices");
  Pairer pairer(V, F, mirror);
  pairer.pair_greedily();
  if (wanted_singles >= 0) pairer.approach(wanted_singles);
  return pairer.result();
}

}  // namespace facewright
