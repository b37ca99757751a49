// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/reference/half_remesher.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

using Eigen::Vector3d;

// 1 for an equilateral triangle, 0 for a degenerate one.
double triangle_shape(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const double sides = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
  return sides > 0 ? 2 * std::sqrt(3.0) * (b - a).cross(c - a).norm() / sides : 0;
}

double facing(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& outward) {
  return (b - a).cross(c - a).normalized().dot(outward.normalized());
}

}  // namespace

HalfRemesher::HalfRemesher(const HalfFace& half, const std::vector<int>& fixed)
    : domain_(half),
      index_(half.neutral, half.F),
      neutral_normals_(vertex_normals(half.neutral, half.F)),
      shape_normals_(vertex_normals(half.shape, half.F)),
      on_curve_(static_cast<size_t>(half.count())),
      rings_(static_cast<size_t>(half.count())) {
  std::vector<bool> is_fixed(static_cast<size_t>(half.count()), false);
  for (const int v : fixed) is_fixed[static_cast<size_t>(v)] = true;
  trace_curves();
  for (int v = 0; v < half.count(); ++v) {
    vertices_.push_back(vertex_of_domain(v));
    vertices_.back().fixed = is_fixed[static_cast<size_t>(v)] || on_curve_[static_cast<size_t>(v)].size() > 1;
    alive_midline_ += vertices_.back().midline;
  }
  alive_vertices_ = half.count();
  for (Eigen::Index f = 0; f < half.F.rows(); ++f) {
    triangles_.push_back({half.F(f, 0), half.F(f, 1), half.F(f, 2)});
    for (const int v : triangles_.back()) ring(v).push_back(static_cast<int>(f));
  }
}

// The border falls into curves between corners: where its kind changes, and at the corner of the mouth. Fixed vertices
// on it are no corners: they just do not move.
void HalfRemesher::trace_curves() {
  std::vector<int> loop = border_loop(domain_);
  const size_t n = loop.size();
  const auto has = [&](const std::vector<bool>& flags, int v) {
    return static_cast<bool>(flags[static_cast<size_t>(v)]);
  };
  const auto kind = [&](size_t i) {
    const int a = loop[i % n], b = loop[(i + 1) % n];
    if (has(domain_.midline, a) && has(domain_.midline, b)) return 0;
    return has(domain_.slit, a) && has(domain_.slit, b) ? 1 : 2;
  };
  int mouth_corner = -1;
  for (size_t i = 0; i < n; ++i)
    if (kind(i) == 1 && (mouth_corner < 0 || domain_.neutral(loop[i], 0) > domain_.neutral(mouth_corner, 0)))
      mouth_corner = loop[i];
  size_t start = 0;
  while (start < n && kind(start) == kind(start + n - 1)) ++start;
  if (start == n) throw InvalidInput("remesh: the half face has no midline");
  std::rotate(loop.begin(), loop.begin() + static_cast<std::ptrdiff_t>(start), loop.end());
  for (size_t i = 0; i < n; ++i) {
    const int a = loop[i], b = loop[(i + 1) % n];
    if (i == 0 || kind(i) != kind(i - 1) || a == mouth_corner) {
      curves_.push_back({{a}, {0.0}, kind(i) == 0, kind(i) == 1});
      on_curve_[static_cast<size_t>(a)].emplace_back(static_cast<int>(curves_.size()) - 1, 0.0);
    }
    Curve& curve = curves_.back();
    curve.arc.push_back(curve.arc.back() + (domain_.shape.row(b) - domain_.shape.row(a)).norm());
    curve.chain.push_back(b);
    on_curve_[static_cast<size_t>(b)].emplace_back(static_cast<int>(curves_.size()) - 1, curve.arc.back());
  }
}

HalfRemesher::Vertex HalfRemesher::vertex_of_domain(int v) const {
  Vertex x;
  x.neutral = domain_.neutral.row(v);
  x.shape = domain_.shape.row(v);
  x.neutral_normal = neutral_normals_.row(v);
  x.shape_normal = shape_normals_.row(v);
  x.size = domain_.size[v];
  x.curves = on_curve_[static_cast<size_t>(v)];
  x.midline = domain_.midline[static_cast<size_t>(v)];
  x.slit = domain_.slit[static_cast<size_t>(v)];
  return x;
}

// Puts a vertex at the surface point nearest to a place on the neutral shape; false if that is on another sheet.
bool HalfRemesher::place(Vertex& v, const Vector3d& neutral) const {
  const NearestPoint hit = index_.nearest(neutral);
  const auto& w = hit.where.barycentric;
  const auto mix = [&](const Vertices& X) {
    Vector3d sum = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) sum += w[k] * X.row(domain_.F(hit.where.triangle, k)).transpose();
    return sum;
  };
  const Vector3d normal = mix(neutral_normals_);
  if (normal.dot(v.neutral_normal) < 0.2) return false;
  v.neutral = mix(domain_.neutral);
  v.shape = mix(domain_.shape);
  v.neutral_normal = normal;
  v.shape_normal = mix(shape_normals_);
  v.size = 0;
  for (int k = 0; k < 3; ++k) v.size += w[k] * domain_.size[domain_.F(hit.where.triangle, k)];
  return true;
}

void HalfRemesher::place_on_curve(Vertex& v, int curve, double arc) const {
  const Curve& c = curves_[static_cast<size_t>(curve)];
  const auto it = std::upper_bound(c.arc.begin() + 1, c.arc.end() - 1, arc);
  const auto i = static_cast<size_t>(it - c.arc.begin());
  const double t = std::clamp((arc - c.arc[i - 1]) / std::max(c.arc[i] - c.arc[i - 1], 1e-12), 0.0, 1.0);
  const int a = c.chain[i - 1], b = c.chain[i];
  v.neutral = (1 - t) * domain_.neutral.row(a) + t * domain_.neutral.row(b);
  v.shape = (1 - t) * domain_.shape.row(a) + t * domain_.shape.row(b);
  v.neutral_normal = (1 - t) * neutral_normals_.row(a) + t * neutral_normals_.row(b);
  v.shape_normal = (1 - t) * shape_normals_.row(a) + t * shape_normals_.row(b);
  v.size = (1 - t) * domain_.size[a] + t * domain_.size[b];
  v.curves = {{curve, arc}};
  v.midline = c.midline;
  v.slit = c.slit;
}

int HalfRemesher::common_curve(int a, int b) const {
  for (const auto& [curve, arc] : at(a).curves)
    for (const auto& [other, other_arc] : at(b).curves)
      if (curve == other) return curve;
  return -1;
}

// How good a triangle is: its shape on the face, and that it faces as the surface below it does, on both shapes.
double HalfRemesher::merit(int a, int b, int c) const {
  const Vertex &p = at(a), &q = at(b), &r = at(c);
  const auto along = [](double cosine) { return std::min(1.0, std::max(cosine, -1.0) + 0.3); };
  const double on_shape = facing(p.shape, q.shape, r.shape, p.shape_normal + q.shape_normal + r.shape_normal);
  const double on_neutral =
      facing(p.neutral, q.neutral, r.neutral, p.neutral_normal + q.neutral_normal + r.neutral_normal);
  const double turn = std::min(along(on_shape), along(on_neutral));
  return triangle_shape(p.shape, q.shape, r.shape) * turn;
}

double HalfRemesher::worst_around(int v) const {
  double worst = 1;
  for (const int t : ring(v)) worst = std::min(worst, merit(triangle(t)[0], triangle(t)[1], triangle(t)[2]));
  return worst;
}

// Mean of edge length over wanted length.
double HalfRemesher::size_factor() const {
  double sum = 0, count = 0;
  for (const auto& [a, b] : edge_list()) sum += relative_length(a, b), ++count;
  return sum / count;
}

std::vector<int> HalfRemesher::neighbours(int v) const {
  std::vector<int> list;
  for (const int t : ring(v))
    for (const int w : triangle(t))
      if (w != v) list.push_back(w);
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
  return list;
}

std::vector<int> HalfRemesher::triangles_of_edge(int a, int b) const {
  std::vector<int> list;
  for (const int t : ring(a))
    if (std::find(triangle(t).begin(), triangle(t).end(), b) != triangle(t).end()) list.push_back(t);
  return list;
}

int HalfRemesher::opposite_corner(int t, int a, int b) const {
  return triangle(t)[0] + triangle(t)[1] + triangle(t)[2] - a - b;
}

std::vector<std::pair<int, int>> HalfRemesher::edge_list() const {
  std::vector<std::pair<int, int>> list;
  for (const Triple& t : triangles_) {
    if (t[0] < 0) continue;
    for (size_t k = 0; k < 3; ++k) list.push_back(std::minmax(t[k], t[(k + 1) % 3]));
  }
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
  return list;
}

HalfFace HalfRemesher::result(const std::vector<int>& fixed, std::vector<int>* vertices_of) const {
  HalfFace half;
  std::vector<int> index(vertices_.size(), -1);
  int n = 0;
  for (size_t v = 0; v < vertices_.size(); ++v)
    if (vertices_[v].alive) index[v] = n++;
  half.neutral.resize(n, 3);
  half.shape.resize(n, 3);
  half.size.resize(n);
  half.source.assign(static_cast<size_t>(n), -1);
  const double factor = size_factor();
  for (size_t v = 0; v < vertices_.size(); ++v) {
    if (index[v] < 0) continue;
    const Vertex& x = vertices_[v];
    half.neutral.row(index[v]) = x.neutral;
    half.shape.row(index[v]) = x.shape;
    if (x.midline) half.neutral(index[v], 0) = half.shape(index[v], 0) = 0;
    half.size[index[v]] = factor * x.size;
    half.midline.push_back(x.midline);
    half.slit.push_back(x.slit);
  }
  std::vector<Triple> kept;
  for (const Triple& t : triangles_)
    if (t[0] >= 0) kept.push_back(t);
  half.F.resize(static_cast<Eigen::Index>(kept.size()), 3);
  for (size_t t = 0; t < kept.size(); ++t)
    for (int k = 0; k < 3; ++k)
      half.F(static_cast<Eigen::Index>(t), k) = index[static_cast<size_t>(kept[t][static_cast<size_t>(k)])];
  vertices_of->clear();
  for (const int v : fixed) vertices_of->push_back(index[static_cast<size_t>(v)]);
  return half;
}

}  // namespace facewright
