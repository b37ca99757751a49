// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// The nearest point of a surface to a query.
struct NearestPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  SurfacePoint where;
  double distance = 0;  ///< millimetres
};

/// Search structure over the triangles of a mesh (a tree of bounding boxes): exact nearest surface points, of equally
/// near triangles the last. Building costs O(M log M). Queries are safe from several threads.
class SurfaceIndex {
 public:
  /// Throws InvalidInput for a mesh without triangles. Degenerate triangles are left out.
  SurfaceIndex(const Vertices& V, const Faces& F);
  ~SurfaceIndex();
  SurfaceIndex(SurfaceIndex&&) noexcept;
  SurfaceIndex& operator=(SurfaceIndex&&) noexcept;

  /// `hint`: a triangle thought to be near, -1: none. It shortens the search and never changes the answer.
  NearestPoint nearest(const Eigen::Vector3d& query, int hint = -1) const;
  /// One result per row of `queries`, on `threads` threads (0 = all).
  std::vector<NearestPoint> nearest(const Vertices& queries, int threads = 1) const;
  /// First crossing of the ray origin + t direction, t >= 0, if there is one.
  std::optional<NearestPoint> first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

/// Search structure over points (FLANN's kd-tree): nearest vertices, some 13 times faster than a surface query.
class PointIndex {
 public:
  explicit PointIndex(const Vertices& points);
  ~PointIndex();
  PointIndex(PointIndex&&) noexcept;
  PointIndex& operator=(PointIndex&&) noexcept;

  /// Index of the nearest point to each query row.
  std::vector<int> nearest(const Vertices& queries) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

/// Barycentric coordinates of the point of triangle (a, b, c) nearest to p. [ericson2005]
Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                    const Eigen::Vector3d& c);

}  // namespace facewright
