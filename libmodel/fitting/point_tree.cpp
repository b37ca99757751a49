// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/point_tree.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

constexpr int leaf_size = 8;

bool closer(const PointTree::Neighbour& a, const PointTree::Neighbour& b) {
  return a.squared_distance < b.squared_distance || (a.squared_distance == b.squared_distance && a.row < b.row);
}

}  // namespace

PointTree::PointTree(const Vertices& points) : points_(points), order_(static_cast<size_t>(points.rows())) {
  if (!points.allFinite()) throw InvalidInput("point tree: expected finite points");
  std::iota(order_.begin(), order_.end(), 0);
  if (points.rows() > 0) build(0, static_cast<int>(points.rows()));
  points_ = points(order_, Eigen::all);
}

int PointTree::build(int first, int last) {
  const int me = static_cast<int>(nodes_.size());
  nodes_.push_back({first, last});
  if (last - first <= leaf_size) return me;
  Eigen::RowVector3d low = points_.row(order_[static_cast<size_t>(first)]), high = low;
  for (int i = first; i < last; ++i) {
    const Eigen::RowVector3d p = points_.row(order_[static_cast<size_t>(i)]);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const int middle = (first + last) / 2;
  std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                   [&](int a, int b) { return std::pair(points_(a, axis), a) < std::pair(points_(b, axis), b); });
  nodes_[static_cast<size_t>(me)].axis = static_cast<int>(axis);
  nodes_[static_cast<size_t>(me)].split = points_(order_[static_cast<size_t>(middle)], axis);
  const int left = build(first, middle), right = build(middle, last);
  nodes_[static_cast<size_t>(me)].left = left;
  nodes_[static_cast<size_t>(me)].right = right;
  return me;
}

PointTree::Neighbour PointTree::nearest(const Eigen::Vector3d& query, double bound) const {
  Neighbour best;
  best.squared_distance = bound * bound;
  if (nodes_.empty()) return best;
  std::pair<int, double> stack[64];  // node and the squared distance to its half-space; depth is log2 N
  int size = 0;
  stack[size++] = {0, 0.0};
  while (size > 0) {
    const auto [index, least] = stack[--size];
    if (least > best.squared_distance) continue;
    const Node& node = nodes_[static_cast<size_t>(index)];
    if (node.axis < 0) {
      for (int i = node.first; i < node.last; ++i) {
        const Neighbour here{order_[static_cast<size_t>(i)], (points_.row(i).transpose() - query).squaredNorm()};
        if (best.row < 0 ? here.squared_distance < best.squared_distance : closer(here, best)) best = here;
      }
      continue;
    }
    const double beyond = query[node.axis] - node.split;
    stack[size++] = {beyond < 0 ? node.right : node.left, beyond * beyond};
    stack[size++] = {beyond < 0 ? node.left : node.right, least};
  }
  return best;
}

std::vector<PointTree::Neighbour> PointTree::nearest(const Eigen::Vector3d& query, int k) const {
  std::vector<Neighbour> best;
  if (nodes_.empty() || k < 1) return best;
  const auto full = [&] { return static_cast<int>(best.size()) == k; };
  std::vector<std::pair<int, double>> stack = {{0, 0.0}};
  while (!stack.empty()) {
    const auto [index, least] = stack.back();
    stack.pop_back();
    if (full() && least > best.back().squared_distance) continue;
    const Node& node = nodes_[static_cast<size_t>(index)];
    if (node.axis < 0) {
      for (int i = node.first; i < node.last; ++i) {
        const Neighbour here{order_[static_cast<size_t>(i)], (points_.row(i).transpose() - query).squaredNorm()};
        if (full() && !closer(here, best.back())) continue;
        if (full()) best.pop_back();
        best.insert(std::upper_bound(best.begin(), best.end(), here, closer), here);
      }
      continue;
    }
    const double beyond = query[node.axis] - node.split;
    stack.emplace_back(beyond < 0 ? node.right : node.left, beyond * beyond);
    stack.emplace_back(beyond < 0 ? node.left : node.right, least);
  }
  return best;
}

}  // namespace facewright
