// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/reference/half_face.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <queue>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

// Keeps the vertices that triangles use, in order.
HalfFace compact(const HalfFace& half, const std::vector<std::array<int, 3>>& triangles) {
  std::vector<int> index(half.midline.size(), -1);
  for (const auto& t : triangles)
    for (const int v : t) index[static_cast<size_t>(v)] = 0;
  HalfFace result;
  std::vector<int> kept;
  for (int v = 0; v < half.count(); ++v)
    if (index[static_cast<size_t>(v)] == 0) {
      index[static_cast<size_t>(v)] = static_cast<int>(kept.size());
      kept.push_back(v);
    }
  result.neutral = half.neutral(kept, Eigen::all);
  result.shape = half.shape(kept, Eigen::all);
  result.size = half.size(kept);
  for (const int v : kept) {
    result.midline.push_back(half.midline[static_cast<size_t>(v)]);
    result.slit.push_back(half.slit[static_cast<size_t>(v)]);
    result.source.push_back(half.source[static_cast<size_t>(v)]);
  }
  result.F.resize(static_cast<Eigen::Index>(triangles.size()), 3);
  for (size_t t = 0; t < triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      result.F(static_cast<Eigen::Index>(t), k) = index[static_cast<size_t>(triangles[t][static_cast<size_t>(k)])];
  return result;
}

// Appends (1 - t) a + t b; on the midline only if both are.
int append_between(HalfFace& h, int a, int b, double t) {
  const int v = h.count();
  h.neutral.conservativeResize(v + 1, 3);
  h.shape.conservativeResize(v + 1, 3);
  h.size.conservativeResize(v + 1);
  h.neutral.row(v) = (1 - t) * h.neutral.row(a) + t * h.neutral.row(b);
  h.shape.row(v) = (1 - t) * h.shape.row(a) + t * h.shape.row(b);
  h.size[v] = (1 - t) * h.size[a] + t * h.size[b];
  h.midline.push_back(h.midline[static_cast<size_t>(a)] && h.midline[static_cast<size_t>(b)]);
  h.slit.push_back(false);
  h.source.push_back(-1);
  return v;
}

void append_triangle(HalfFace& h, int a, int b, int c) {
  h.F.conservativeResize(h.F.rows() + 1, 3);
  h.F.row(h.F.rows() - 1) << a, b, c;
}

// Arrival at c over the triangle (a, b, c) of a wave front that passed a and b, or infinity if it comes from outside.
double front_arrival(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, double ta,
                     double tb) {
  const Eigen::Vector3d ab = b - a, ac = c - a;
  const double length = ab.norm();
  if (length <= 0 || std::abs(tb - ta) > length) return INFINITY;
  // Source in the triangle's plane, a at the origin and b at (length, 0): the point at distances ta and tb, below.
  const double sx = (ta * ta - tb * tb + length * length) / (2 * length);
  const double below = ta * ta - sx * sx;
  if (below < 0) return INFINITY;
  const double sy = -std::sqrt(below), cx = ac.dot(ab) / length,
               cy = std::sqrt(std::max(0.0, ac.squaredNorm() - cx * cx));
  const double crossing = sx + (cx - sx) * (-sy) / (cy - sy);  // where the ray passes the edge
  if (!(crossing >= 0 && crossing <= length)) return INFINITY;
  return std::hypot(cx - sx, cy - sy);
}

}  // namespace

HalfFace left_half(const MultiresTemplate& reference, const Vertices& shape) {
  const Faces& F = reference.levels.back().F;
  const Vertices& T = reference.V;
  HalfFace whole;
  whole.neutral = T;
  whole.shape = shape;
  const TemplateLevel& base = reference.levels.front();
  whole.size = refine_field(reference.parents, base.vertex_count,
                            vertex_edge_lengths(shape.topRows(base.vertex_count), base.F), static_cast<int>(T.rows()));
  whole.midline.resize(static_cast<size_t>(T.rows()));
  whole.slit.assign(static_cast<size_t>(T.rows()), false);
  for (Eigen::Index v = 0; v < T.rows(); ++v) {
    whole.midline[static_cast<size_t>(v)] = reference.mirror[static_cast<size_t>(v)] == v;
    whole.source.push_back(static_cast<int>(v));
    if (whole.midline[static_cast<size_t>(v)]) whole.neutral(v, 0) = whole.shape(v, 0) = 0;
  }
  if (const auto region = reference.regions.find("mouth_slit"); region != reference.regions.end()) {
    const auto loops = boundary_loops(F);
    for (size_t l = 1; l < loops.size(); ++l)
      if (std::binary_search(region->second.begin(), region->second.end(), loops[l].front()))
        for (const int v : loops[l]) whole.slit[static_cast<size_t>(v)] = true;
  }
  std::vector<std::array<int, 3>> triangles;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    double least = 0, most = 0;
    for (int k = 0; k < 3; ++k) {
      least = std::min(least, whole.neutral(F(f, k), 0));
      most = std::max(most, whole.neutral(F(f, k), 0));
    }
    if (least < 0 && most > 0) throw InvalidInput("left_half: a triangle of the reference crosses the midline");
    if (most > 0) triangles.push_back({F(f, 0), F(f, 1), F(f, 2)});
  }
  return compact(whole, triangles);
}

std::vector<int> border_loop(const HalfFace& half) {
  auto loops = boundary_loops(half.F);
  if (loops.size() != 1)
    throw InvalidInput("half face: expected one border, found " + std::to_string(loops.size()) +
                       "; a crop must keep the mouth whole");
  return std::move(loops.front());
}

MirroredFace mirror_half(const HalfFace& half) {
  MirroredFace whole;
  std::vector<int> right;
  int n = 0;
  for (const bool middle : half.midline) {
    whole.left.push_back(n++);
    right.push_back(middle ? whole.left.back() : n++);
  }
  whole.V.resize(n, 3);
  whole.mirror.resize(static_cast<size_t>(n));
  for (int i = 0; i < half.count(); ++i) {
    const int l = whole.left[static_cast<size_t>(i)], r = right[static_cast<size_t>(i)];
    Eigen::RowVector3d p = half.shape.row(i).unaryExpr([](double x) { return std::round(x * 1e4) / 1e4 + 0.0; });
    if (l == r) p.x() = 0;
    whole.V.row(l) = p;
    if (l != r) whole.V.row(r) << -p.x(), p.y(), p.z();
    whole.mirror[static_cast<size_t>(l)] = r;
    whole.mirror[static_cast<size_t>(r)] = l;
  }
  whole.F.resize(2 * half.F.rows(), 3);
  for (Eigen::Index f = 0; f < half.F.rows(); ++f) {
    const auto a = static_cast<size_t>(half.F(f, 0)), b = static_cast<size_t>(half.F(f, 1)),
               c = static_cast<size_t>(half.F(f, 2));
    whole.F.row(2 * f) << whole.left[a], whole.left[b], whole.left[c];
    whole.F.row(2 * f + 1) << right[a], right[c], right[b];
  }
  return whole;
}

LipMargins lip_margins(const HalfFace& half) {
  std::vector<int> loop = border_loop(half);
  const auto is_slit = [&](int v) { return half.slit[static_cast<size_t>(v)]; };
  const size_t n = loop.size();
  size_t start = 0;
  while (start < n && !(is_slit(loop[start]) && !is_slit(loop[(start + n - 1) % n]))) ++start;
  if (start == n) return {};
  std::rotate(loop.begin(), loop.begin() + static_cast<std::ptrdiff_t>(start), loop.end());
  const auto end = std::find_if_not(loop.begin(), loop.end(), is_slit);
  const auto corner =
      std::max_element(loop.begin(), end, [&](int a, int b) { return half.neutral(a, 0) < half.neutral(b, 0); });
  LipMargins lips{{loop.begin(), corner + 1}, {corner, end}};
  std::reverse(lips.lower.begin(), lips.lower.end());
  if (half.neutral(lips.upper.front(), 1) < half.neutral(lips.lower.front(), 1)) std::swap(lips.upper, lips.lower);
  return lips;
}

// The margins run from the midline to the corner they share: zip them from there on, the shorter rung first.
HalfFace close_mouth(const HalfFace& half) {
  const auto [upper, lower] = lip_margins(half);
  HalfFace closed = half;
  if (upper.size() < 2 || lower.size() < 2) return closed;
  size_t i = upper.size() - 2, j = lower.size() - 2;
  append_triangle(closed, upper[i], lower[j], upper.back());
  const auto rung = [&half, &a = upper, &b = lower](size_t u, size_t l) {  // clang 14 captures no bindings by name
    return (half.neutral.row(a[u]) - half.neutral.row(b[l])).norm();
  };
  while (i > 0 || j > 0) {
    if (j == 0 || (i > 0 && rung(i - 1, j) <= rung(i, j - 1))) {
      append_triangle(closed, upper[i - 1], lower[j], upper[i]);
      --i;
    } else {
      append_triangle(closed, upper[i], lower[j - 1], lower[j]);
      --j;
    }
  }
  return closed;
}

Eigen::VectorXd geodesic_distances(const HalfFace& half, int source) {
  const HalfFace h = close_mouth(half);
  const auto around = vertex_faces(h.count(), h.F);
  Eigen::VectorXd distance = Eigen::VectorXd::Constant(h.count(), INFINITY);
  std::vector<bool> final(static_cast<size_t>(h.count()), false);
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
  const auto lower = [&](int v, double d) {
    if (d < distance[v]) front.emplace(distance[v] = d, v);
  };
  lower(source, 0);
  while (!front.empty()) {
    const auto [d, v] = front.top();
    front.pop();
    if (final[static_cast<size_t>(v)]) continue;
    final[static_cast<size_t>(v)] = true;
    for (const int* f = around.begin(v); f != around.end(v); ++f)
      for (int k = 0; k < 3; ++k) {
        const int c = h.F(*f, k);
        if (c == v || final[static_cast<size_t>(c)]) continue;
        lower(c, d + (h.shape.row(c) - h.shape.row(v)).norm());
        const int b = h.F(*f, 0) + h.F(*f, 1) + h.F(*f, 2) - v - c;
        if (final[static_cast<size_t>(b)])
          lower(c, front_arrival(h.shape.row(v), h.shape.row(b), h.shape.row(c), d, distance[b]));
      }
  }
  return distance;
}

int split_edge(HalfFace& half, int a, int b, double t) {
  const int v = append_between(half, a, b, t);
  half.slit.back() = half.slit[static_cast<size_t>(a)] && half.slit[static_cast<size_t>(b)];
  const Eigen::Index rows = half.F.rows();
  for (Eigen::Index f = 0; f < rows; ++f)
    for (int k = 0; k < 3; ++k) {
      const int p = half.F(f, k), q = half.F(f, (k + 1) % 3), apex = half.F(f, (k + 2) % 3);
      if (!((p == a && q == b) || (p == b && q == a))) continue;
      half.F.row(f) << p, v, apex;
      append_triangle(half, v, q, apex);
      break;
    }
  return v;
}

int split_triangle(HalfFace& half, int f, const Eigen::Vector3d& w) {
  const int a = half.F(f, 0), b = half.F(f, 1), c = half.F(f, 2);
  const int v = append_between(half, a, b, 0.5);
  half.neutral.row(v) = w[0] * half.neutral.row(a) + w[1] * half.neutral.row(b) + w[2] * half.neutral.row(c);
  half.shape.row(v) = w[0] * half.shape.row(a) + w[1] * half.shape.row(b) + w[2] * half.shape.row(c);
  half.size[v] = w[0] * half.size[a] + w[1] * half.size[b] + w[2] * half.size[c];
  half.midline.back() = half.slit.back() = false;
  half.F.row(f) << a, b, v;
  append_triangle(half, b, c, v);
  append_triangle(half, c, a, v);
  return v;
}

HalfFace crop(const HalfFace& half, const Eigen::VectorXd& field, double level, int keep) {
  if (!(field[keep] < level)) throw InvalidInput("crop: the point to keep lies beyond the line");
  HalfFace h = half;
  std::vector<bool> below(static_cast<size_t>(h.count()));
  for (int v = 0; v < h.count(); ++v) below[static_cast<size_t>(v)] = field[v] < level;
  std::map<std::pair<int, int>, int> cuts;
  const auto cut = [&](int a, int b) {
    if (a > b) std::swap(a, b);
    const auto [it, is_new] = cuts.try_emplace({a, b}, -1);
    if (is_new)
      it->second = append_between(h, a, b, std::clamp((level - field[a]) / (field[b] - field[a]), 0.02, 0.98));
    return it->second;
  };
  std::vector<std::array<int, 3>> triangles;
  for (Eigen::Index f = 0; f < half.F.rows(); ++f) {
    int k = 0, inside = 0;
    for (int i = 0; i < 3; ++i) inside += below[static_cast<size_t>(half.F(f, i))];
    if (inside == 0) continue;
    if (inside == 3) {
      triangles.push_back({half.F(f, 0), half.F(f, 1), half.F(f, 2)});
      continue;
    }
    while (below[static_cast<size_t>(half.F(f, k))] != (inside == 1)) ++k;  // the corner alone on its side
    const int a = half.F(f, k), b = half.F(f, (k + 1) % 3), c = half.F(f, (k + 2) % 3);
    const int ab = cut(a, b), ca = cut(c, a);
    if (inside == 1) {
      triangles.push_back({a, ab, ca});
    } else {
      triangles.push_back({ab, b, c});
      triangles.push_back({ab, c, ca});
    }
  }
  h.F.resize(static_cast<Eigen::Index>(triangles.size()), 3);
  for (size_t t = 0; t < triangles.size(); ++t)
    h.F.row(static_cast<Eigen::Index>(t)) << triangles[t][0], triangles[t][1], triangles[t][2];
  const Components parts = connected_components(h.count(), h.F);
  const int label = parts.vertex_label[static_cast<size_t>(keep)];
  std::erase_if(triangles, [&](const auto& t) { return parts.vertex_label[static_cast<size_t>(t[0])] != label; });
  return compact(h, triangles);
}

}  // namespace facewright
