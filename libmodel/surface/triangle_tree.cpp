// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/surface/triangle_tree.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libmodel/surface/nearest.h"

namespace facewright {
namespace {

constexpr int kLeaf = 4;    // triangles
constexpr int kStack = 64;  // nodes put aside; halving 2^31 triangles needs half as many
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-9;  // relative slack of squared distances

struct Waiting {
  int child, leaf_count;
  double squared;  // of its box
};

}  // namespace

TriangleTree::TriangleTree(const Vertices& V, const Faces& F) : place_(static_cast<size_t>(F.rows()), -1) {
  std::vector<Item> items;
  items.reserve(static_cast<size_t>(F.rows()));
  double extent = 0;
  for (int f = 0; f < F.rows(); ++f) {
    const Eigen::Vector3d a = V.row(F(f, 0)), b = V.row(F(f, 1)), c = V.row(F(f, 2));
    if (!((b - a).cross(c - a).norm() > 1e-12)) continue;
    const Eigen::Vector3f middle = ((a + b + c) / 3).cast<float>();
    items.push_back({{middle[0], middle[1], middle[2]}, f});
    extent = std::max({extent, a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff(), c.cwiseAbs().maxCoeff()});
  }
  if (items.empty()) return;
  // A distance is uncertain by some 4e-16 extents, d; (x + d)^2 <= (1 + r) x^2 + (1 + 1/r) d^2.
  noise_ = std::pow(4e-16 * extent, 2) / kRounding;
  nodes_.reserve(items.size());
  triangles_.reserve(items.size());
  faces_.reserve(items.size());
  build(V, F, items, 0, static_cast<int>(items.size()));
}

void TriangleTree::set_child(const Vertices& V, const Faces& F, std::vector<Item>& items, int node, int side, int first,
                             int last) {
  Eigen::Array3d low = Eigen::Array3d::Constant(kInfinity), high = -low;
  for (int i = first; i < last; ++i)
    for (int k = 0; k < 3; ++k) {
      const Eigen::Array3d x = V.row(F(items[static_cast<size_t>(i)].face, k)).transpose();
      low = low.min(x), high = high.max(x);
    }
  for (int axis = 0; axis < 3; ++axis) {
    nodes_[static_cast<size_t>(node)].low[axis][side] = low[axis];
    nodes_[static_cast<size_t>(node)].high[axis][side] = high[axis];
  }
  int child = static_cast<int>(faces_.size()), count = last - first;
  if (count > kLeaf) {
    child = build(V, F, items, first, last);
    count = 0;
  } else {
    for (int i = first; i < last; ++i) {
      const int f = items[static_cast<size_t>(i)].face;
      place_[static_cast<size_t>(f)] = static_cast<int>(faces_.size());
      faces_.push_back(f);
      triangles_.push_back({{V.row(F(f, 0)), V.row(F(f, 1)), V.row(F(f, 2))}});
    }
  }
  nodes_[static_cast<size_t>(node)].child[side] = child;
  nodes_[static_cast<size_t>(node)].leaf_count[side] = count;
}

int TriangleTree::build(const Vertices& V, const Faces& F, std::vector<Item>& items, int first, int last) {
  const int node = static_cast<int>(nodes_.size());
  nodes_.emplace_back();
  Eigen::Array3f low = Eigen::Array3f::Constant(std::numeric_limits<float>::infinity()), high = -low;
  for (int i = first; i < last; ++i) {
    const Eigen::Array3f x = Eigen::Map<const Eigen::Array3f>(items[static_cast<size_t>(i)].middle);
    low = low.min(x), high = high.max(x);
  }
  int axis;
  (high - low).maxCoeff(&axis);
  const int middle = first + (last - first + 1) / 2;  // the second child of a single triangle is empty
  if (middle < last)
    std::nth_element(items.begin() + first, items.begin() + middle, items.begin() + last,
                     [axis](const Item& a, const Item& b) { return a.middle[axis] < b.middle[axis]; });
  set_child(V, F, items, node, 0, first, middle);
  set_child(V, F, items, node, 1, middle, last);
  return node;
}

void TriangleTree::try_triangles(const Eigen::Vector3d& query, int first, int count, Hit* best) const {
  for (int i = first; i < first + count; ++i) {
    const Eigen::Vector3d* t = triangles_[static_cast<size_t>(i)].corners;
    const Eigen::Vector3d b = nearest_on_triangle(query, t[0], t[1], t[2]);
    const double squared = (b[0] * t[0] + b[1] * t[1] + b[2] * t[2] - query).squaredNorm();
    const int face = faces_[static_cast<size_t>(i)];
    if (squared < best->squared || (squared == best->squared && face > best->face)) *best = {face, b, squared};
  }
}

TriangleTree::Hit TriangleTree::nearest(const Eigen::Vector3d& query, int hint) const {
  Hit best;
  best.squared = kInfinity;
  if (hint >= 0 && place_[static_cast<size_t>(hint)] >= 0)
    try_triangles(query, place_[static_cast<size_t>(hint)], 1, &best);
  Waiting stack[kStack];
  int waiting = 0;
  stack[waiting++] = {0, 0, 0};
  while (waiting > 0) {
    const Waiting next = stack[--waiting];
    if (next.squared > (1 + kRounding) * best.squared + noise_) continue;
    if (next.leaf_count > 0) {
      try_triangles(query, next.child, next.leaf_count, &best);
      continue;
    }
    const Node& n = nodes_[static_cast<size_t>(next.child)];
    Eigen::Array2d squared = Eigen::Array2d::Zero();
    for (int axis = 0; axis < 3; ++axis)
      squared += (n.low[axis] - query[axis]).max(query[axis] - n.high[axis]).max(0.0).square();
    const int near = squared[0] <= squared[1] ? 0 : 1;
    for (const int side : {1 - near, near})
      if (squared[side] <= (1 + kRounding) * best.squared + noise_ && squared[side] < kInfinity)
        stack[waiting++] = {n.child[side], n.leaf_count[side], squared[side]};
  }
  return best;
}

std::optional<TriangleTree::Hit> TriangleTree::first_hit(const Eigen::Vector3d& origin,
                                                         const Eigen::Vector3d& direction) const {
  constexpr double kEdge = 1e-12;  // rays along an edge meet one of its triangles
  Hit best;
  best.squared = kInfinity;
  Eigen::Array3d inverse;
  for (int axis = 0; axis < 3; ++axis) inverse[axis] = direction[axis] == 0 ? 1e300 : 1 / direction[axis];
  Waiting stack[kStack];
  int waiting = 0;
  stack[waiting++] = {0, 0, 0};
  while (waiting > 0) {
    const Waiting next = stack[--waiting];
    if (next.squared > best.squared) continue;
    for (int i = next.child; i < next.child + next.leaf_count; ++i) {
      const Eigen::Vector3d* t = triangles_[static_cast<size_t>(i)].corners;
      const Eigen::Vector3d u = t[1] - t[0], v = t[2] - t[0], p = direction.cross(v), s = origin - t[0], q = s.cross(u);
      const double volume = u.dot(p);
      if (volume == 0) continue;
      const double b1 = s.dot(p) / volume, b2 = direction.dot(q) / volume, along = v.dot(q) / volume;
      if (b1 < -kEdge || b2 < -kEdge || b1 + b2 > 1 + kEdge || along < 0) continue;
      const int face = faces_[static_cast<size_t>(i)];
      if (along < best.squared || (along == best.squared && face > best.face))
        best = {face, {1 - b1 - b2, b1, b2}, along};
    }
    if (next.leaf_count > 0) continue;
    const Node& n = nodes_[static_cast<size_t>(next.child)];
    Eigen::Array2d enter = Eigen::Array2d::Zero(), leave = Eigen::Array2d::Constant(kInfinity);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Array2d a = (n.low[axis] - origin[axis]) * inverse[axis];
      const Eigen::Array2d b = (n.high[axis] - origin[axis]) * inverse[axis];
      enter = enter.max(a.min(b)), leave = leave.min(a.max(b));
    }
    const int near = enter[0] <= enter[1] ? 0 : 1;
    for (const int side : {1 - near, near})
      if (enter[side] <= leave[side] * (1 + kRounding) && enter[side] <= best.squared)
        stack[waiting++] = {n.child[side], n.leaf_count[side], enter[side]};
  }
  if (best.face < 0) return {};
  return best;
}

Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                    const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - t, t};
  }
  const double total = va + vb + vc;
  return {va / total, vb / total, vc / total};
}

}  // namespace facewright
