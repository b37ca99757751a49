// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/surface_points.h"

#include <Eigen/LU>
#include <algorithm>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

constexpr double kSlack = 1e-9;  // of barycentric coordinates on a shared edge

// Barycentric coordinates in one coarse triangle, of the vertices that lie in it.
class TriangleWeights {
 public:
  TriangleWeights(const Eigen::RowVector3i& corners, int coarse_count, const std::vector<VertexParents>& parents)
      : weights_(static_cast<size_t>(coarse_count) + parents.size()), known_(weights_.size(), false) {
    for (int k = 0; k < 3; ++k) set(static_cast<size_t>(corners[k]), Eigen::Vector3d::Unit(k));
    for (size_t i = 0; i < parents.size(); ++i) {
      const VertexParents& p = parents[i];
      if (!has(p.a) || !has(p.b) || (!p.is_midpoint() && !has(p.c))) continue;
      const Eigen::Vector3d sum = at(p.a) + at(p.b);
      set(static_cast<size_t>(coarse_count) + i,
          p.is_midpoint() ? Eigen::Vector3d(sum / 2) : Eigen::Vector3d((sum + at(p.c)) / 3));
    }
  }
  bool has(int v) const { return static_cast<size_t>(v) < known_.size() && known_[static_cast<size_t>(v)]; }
  const Eigen::Vector3d& at(int v) const { return weights_[static_cast<size_t>(v)]; }

 private:
  void set(size_t v, const Eigen::Vector3d& w) {
    weights_[v] = w;
    known_[v] = true;
  }
  std::vector<Eigen::Vector3d> weights_;
  std::vector<bool> known_;
};

}  // namespace

SurfacePoint carry_point(const SurfacePoint& point, const Faces& coarse, int coarse_count,
                         const std::vector<VertexParents>& parents, const Faces& fine) {
  if (point.triangle < 0 || point.triangle >= coarse.rows())
    throw InvalidInput("surface point: triangle " + std::to_string(point.triangle) + " does not exist");
  const TriangleWeights weights(coarse.row(point.triangle), coarse_count, parents);
  SurfacePoint best;
  double deepest = -1;
  for (int f = 0; f < fine.rows(); ++f) {
    if (!weights.has(fine(f, 0)) || !weights.has(fine(f, 1)) || !weights.has(fine(f, 2))) continue;
    Eigen::Matrix3d W;
    for (int k = 0; k < 3; ++k) W.col(k) = weights.at(fine(f, k));
    const Eigen::FullPivLU<Eigen::Matrix3d> solver(W);
    if (!solver.isInvertible()) continue;  // three vertices of one edge: a triangle of the neighbour
    const Eigen::Vector3d b = solver.solve(point.barycentric);
    if (b.minCoeff() <= deepest) continue;
    deepest = b.minCoeff();
    best = {f, b};
  }
  if (deepest < -kSlack)
    throw InvalidInput("surface point: no triangle of the finer level lies in triangle " +
                       std::to_string(point.triangle) + " of the coarser one");
  best.barycentric = best.barycentric.cwiseMax(0);
  best.barycentric /= best.barycentric.sum();
  return best;
}

SurfacePoint point_at_vertex(const Faces& F, int v) {
  for (int f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k)
      if (F(f, k) == v) return {f, Eigen::Vector3d::Unit(k)};
  return {};
}

std::vector<SurfacePoint> points_at_vertices(const Faces& F, const std::vector<int>& vertices) {
  std::vector<SurfacePoint> points(vertices.size());
  if (vertices.empty() || F.size() == 0) return points;
  const int last = std::min(*std::max_element(vertices.begin(), vertices.end()), F.maxCoeff());
  std::vector<Eigen::Index> first(static_cast<size_t>(last + 1), -1);  // corner of F, counted by rows
  for (Eigen::Index i = F.size() - 1; i >= 0; --i)
    if (F.data()[i] >= 0 && F.data()[i] <= last) first[static_cast<size_t>(F.data()[i])] = i;
  for (size_t i = 0; i < vertices.size(); ++i) {
    const Eigen::Index corner = vertices[i] < 0 || vertices[i] > last ? -1 : first[static_cast<size_t>(vertices[i])];
    if (corner >= 0) points[i] = {static_cast<int>(corner / 3), Eigen::Vector3d::Unit(corner % 3)};
  }
  return points;
}

}  // namespace facewright
