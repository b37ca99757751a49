// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>

#include "libregister/reference/half_remesher.h"

namespace facewright {
namespace {

using Eigen::Vector3d;

double angle(const Vector3d& apex, const Vector3d& a, const Vector3d& b) {
  return std::atan2((a - apex).cross(b - apex).norm(), (a - apex).dot(b - apex));
}

constexpr double least_merit = 0.2;  // a move may only go below it where things were worse

}  // namespace

bool HalfRemesher::may_collapse(int a, int b, const std::vector<int>& shared) const {
  const Vertex &from = at(a), &to = at(b);
  if (from.fixed) return false;
  const bool border_edge = shared.size() == 1;
  if (!from.curves.empty() && (!border_edge || common_curve(a, b) < 0)) return false;
  const std::vector<int> near_a = neighbours(a), near_b = neighbours(b);
  std::vector<int> common;
  std::set_intersection(near_a.begin(), near_a.end(), near_b.begin(), near_b.end(), std::back_inserter(common));
  if (common.size() != shared.size()) return false;
  if (near_a.size() + near_b.size() - common.size() > 11) return false;  // valence of what is left, 9 at most
  // An inner edge between two midline vertices would coincide with its mirror image.
  if (to.midline)
    for (const int n : near_a) {
      if (n == b || !at(n).midline || std::binary_search(common.begin(), common.end(), n)) continue;
      if (!(from.midline && triangles_of_edge(a, n).size() == 1)) return false;
    }
  return true;
}

bool HalfRemesher::collapse(int a, int b) {
  const std::vector<int> shared = triangles_of_edge(a, b);
  if (shared.empty() || !may_collapse(a, b, shared)) return false;
  double before = 1, after = 1;
  for (const int t : ring(a)) {
    Triple moved = triangle(t);
    before = std::min(before, merit(moved[0], moved[1], moved[2]));
    if (std::find(shared.begin(), shared.end(), t) != shared.end()) continue;
    std::replace(moved.begin(), moved.end(), a, b);
    after = std::min(after, merit(moved[0], moved[1], moved[2]));
  }
  if (after < std::min(least_merit, before)) return false;
  for (const int t : shared) {
    for (const int v : triangle(t))
      if (v != a) std::erase(ring(v), t);
    triangles_[static_cast<size_t>(t)] = {-1, -1, -1};
  }
  for (const int t : ring(a)) {
    if (triangle(t)[0] < 0) continue;
    std::replace(triangles_[static_cast<size_t>(t)].begin(), triangles_[static_cast<size_t>(t)].end(), a, b);
    ring(b).push_back(t);
  }
  ring(a).clear();
  at(a).alive = false;
  --alive_vertices_;
  alive_midline_ -= at(a).midline;
  return true;
}

void HalfRemesher::thin_out(int target) {
  using Entry = std::pair<double, std::pair<int, int>>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> shortest;
  for (const auto& [a, b] : edge_list()) shortest.push({relative_length(a, b), {a, b}});
  while (!shortest.empty() && whole_count() > target) {
    const auto [a, b] = shortest.top().second;
    shortest.pop();
    if (!at(a).alive || !at(b).alive) continue;
    int left = -1;
    if (collapse(a, b))
      left = b;
    else if (collapse(b, a))
      left = a;
    if (left < 0) continue;
    for (const int n : neighbours(left)) shortest.push({relative_length(left, n), std::minmax(left, n)});
  }
}

int HalfRemesher::split(int a, int b) {
  const std::vector<int> shared = triangles_of_edge(a, b);
  Vertex middle = at(a);
  middle.fixed = middle.midline = middle.slit = false;
  middle.curves.clear();
  middle.neutral_normal += at(b).neutral_normal;
  if (shared.size() == 1) {
    const int curve = common_curve(a, b);
    double arc = 0;
    for (const int v : {a, b})
      for (const auto& [c, s] : at(v).curves)
        if (c == curve) arc += 0.5 * s;
    place_on_curve(middle, curve, arc);
  } else if (!place(middle, 0.5 * (at(a).neutral + at(b).neutral))) {
    return -1;
  }
  const int m = static_cast<int>(vertices_.size());
  vertices_.push_back(middle);
  rings_.emplace_back();
  ++alive_vertices_;
  alive_midline_ += middle.midline;
  for (const int t : shared) {
    Triple other = triangle(t);
    std::replace(triangles_[static_cast<size_t>(t)].begin(), triangles_[static_cast<size_t>(t)].end(), b, m);
    std::replace(other.begin(), other.end(), a, m);
    const int u = static_cast<int>(triangles_.size());
    triangles_.push_back(other);
    std::erase(ring(b), t);
    ring(b).push_back(u);
    ring(opposite_corner(t, a, m)).push_back(u);
    ring(m).push_back(t);
    ring(m).push_back(u);
  }
  return m;
}

// Angle between the planes of the triangles (a, b, c) and (b, a, d) on the shape, radians.
double HalfRemesher::sharpest_turn(int a, int b, int c, int d) const {
  const Vector3d n = (at(b).shape - at(a).shape).cross(at(c).shape - at(a).shape);
  const Vector3d m = (at(a).shape - at(b).shape).cross(at(d).shape - at(b).shape);
  return std::atan2(n.cross(m).norm(), n.dot(m));
}

bool HalfRemesher::flip(int a, int b) {
  const std::vector<int> shared = triangles_of_edge(a, b);
  if (shared.size() != 2) return false;
  int f = shared[0], g = shared[1];
  const Triple& tf = triangle(f);
  const auto k = static_cast<size_t>(std::find(tf.begin(), tf.end(), a) - tf.begin());
  if (tf[(k + 1) % 3] != b) std::swap(f, g);  // f runs a -> b
  const int p = opposite_corner(f, a, b), q = opposite_corner(g, a, b);
  if (angle(at(p).shape, at(a).shape, at(b).shape) + angle(at(q).shape, at(a).shape, at(b).shape) <=
      std::numbers::pi + 1e-6)
    return false;
  if ((at(p).midline && at(q).midline) || !triangles_of_edge(p, q).empty()) return false;
  const double before = std::min(merit(a, b, p), merit(b, a, q)), after = std::min(merit(p, a, q), merit(p, q, b));
  if (after < before && after < 0.4) return false;
  for (const int v : {a, b})
    if (at(v).curves.empty() && ring(v).size() <= 4) return false;
  if (sharpest_turn(p, q, b, a) > std::max(1.2, sharpest_turn(a, b, p, q))) return false;
  triangles_[static_cast<size_t>(f)] = {p, a, q};
  triangles_[static_cast<size_t>(g)] = {p, q, b};
  std::erase(ring(b), f);
  std::erase(ring(a), g);
  ring(q).push_back(f);
  ring(p).push_back(g);
  return true;
}

void HalfRemesher::flip_edges() {
  for (int pass = 0; pass < 10; ++pass) {
    bool any = false;
    for (const auto& [a, b] : edge_list()) any = flip(a, b) || any;
    if (!any) return;
  }
}

void HalfRemesher::split_long(double factor) {
  const double longest = factor * size_factor();
  for (const auto& [a, b] : edge_list())
    if (relative_length(a, b) > longest) split(a, b);
}

void HalfRemesher::collapse_short(double factor) {
  const double shortest = factor * size_factor();
  for (const auto& [a, b] : edge_list())
    if (at(a).alive && at(b).alive && !triangles_of_edge(a, b).empty() && relative_length(a, b) < shortest)
      collapse_either(a, b);
}

// One collapse or split towards the target; whole_count() changes by 1 on the midline and by 2 elsewhere.
bool HalfRemesher::adjust_once(int missing) {
  std::vector<std::pair<double, std::pair<int, int>>> list;
  const bool one_step = missing % 2 != 0;
  for (const auto& [a, b] : edge_list()) {
    const int curve = triangles_of_edge(a, b).size() == 1 ? common_curve(a, b) : -1;
    const bool on_midline = curve >= 0 && curves_[static_cast<size_t>(curve)].midline;
    if (on_midline == one_step) list.push_back({relative_length(a, b), {a, b}});
  }
  std::sort(list.begin(), list.end());
  if (missing > 0) std::reverse(list.begin(), list.end());
  for (const auto& [length, edge] : list) {
    if (missing > 0 ? split(edge.first, edge.second) >= 0 : collapse_either(edge.first, edge.second)) return true;
  }
  return false;
}

bool HalfRemesher::reach(int target) {
  for (int guard = 0; whole_count() != target; ++guard) {
    const int missing = target - whole_count();
    if (missing < -40)
      thin_out(target + 2);
    else if (!adjust_once(missing) && (missing > 0 || missing % 2 == 0 || !adjust_once(1)))
      return false;
    if (guard > 50000) return false;
    if (missing == target - whole_count()) return false;
  }
  return true;
}

bool HalfRemesher::move(int v, Vertex moved, double least) {
  const double before = worst_around(v);
  std::swap(at(v), moved);
  const double after = worst_around(v);
  if (after >= std::min(least, before)) return true;
  std::swap(at(v), moved);
  return false;
}

void HalfRemesher::smooth() {
  for (int v = 0; v < static_cast<int>(vertices_.size()); ++v) {
    if (!at(v).alive || at(v).fixed) continue;
    Vertex moved = at(v);
    if (!at(v).curves.empty()) {
      const auto [curve, arc] = at(v).curves.front();
      double sum = 0, count = 0;
      for (const int n : neighbours(v))
        if (triangles_of_edge(v, n).size() == 1)
          for (const auto& [c, s] : at(n).curves)
            if (c == curve) sum += s / at(n).size, count += 1 / at(n).size;
      if (count <= 0) continue;
      place_on_curve(moved, curve, 0.4 * arc + 0.6 * sum / count);
    } else {
      Vector3d sum = Vector3d::Zero();
      double weight = 0;
      for (const int t : ring(v)) {
        const Vertex &a = at(triangle(t)[0]), &b = at(triangle(t)[1]), &c = at(triangle(t)[2]);
        const double size = (a.size + b.size + c.size) / 3;
        const double w = (b.shape - a.shape).cross(c.shape - a.shape).norm() / std::pow(size, 4);
        sum += w * (a.neutral + b.neutral + c.neutral) / 3;
        weight += w;
      }
      const Vector3d n = at(v).neutral_normal.normalized();
      Vector3d step = 0.7 * (sum / weight - at(v).neutral);
      step -= n * n.dot(step);
      if (!place(moved, at(v).neutral + step)) continue;
    }
    move(v, moved, least_merit);
  }
}

void HalfRemesher::improve_worst(int round) {
  Random random(static_cast<std::uint64_t>(round));
  const double reach = 0.3 / (1 + 0.2 * round) * size_factor();
  for (int v = 0; v < static_cast<int>(vertices_.size()); ++v) {
    if (!at(v).alive || at(v).fixed) continue;
    if (worst_around(v) > 0.8) continue;
    for (int trial = 0; trial < 8; ++trial) {
      Vertex moved = at(v);
      const double step = reach * at(v).size;
      if (!at(v).curves.empty()) {
        const auto [curve, arc] = at(v).curves.front();
        place_on_curve(moved, curve, arc + step * random.normal());
      } else if (!place(moved, at(v).neutral + step * Vector3d(random.normal(), random.normal(), random.normal()))) {
        continue;
      }
      move(v, moved, 1);
    }
  }
}

}  // namespace facewright
