// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// Bounding boxes over triangles, halved at the median of their middles. [ericson2005]
/// Answers do not depend on where a query starts: among triangles equally near, the last of the mesh is taken.
class TriangleTree {
 public:
  /// Triangles without an area are left out.
  TriangleTree(const Vertices& V, const Faces& F);

  bool empty() const { return faces_.empty(); }

  struct Hit {
    int face = -1;
    Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
    double squared = 0;  ///< distance from the query, squared; along a ray: the parameter
  };
  /// Nearest surface point; `hint` is a triangle thought to be near (-1: none), which makes the search shorter.
  Hit nearest(const Eigen::Vector3d& query, int hint = -1) const;
  /// First crossing of origin + t direction, t >= 0.
  std::optional<Hit> first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

 private:
  struct Triangle {
    Eigen::Vector3d corners[3];
  };
  // Both children's boxes side by side; a child is a node, or a leaf's first triangle and their number.
  struct Node {
    Eigen::Array2d low[3], high[3];
    int child[2];
    int leaf_count[2];  // 0: `child` is a node
  };

  struct Item {
    float middle[3];
    int face;
  };

  int build(const Vertices& V, const Faces& F, std::vector<Item>& items, int first, int last);
  void set_child(const Vertices& V, const Faces& F, std::vector<Item>& items, int node, int side, int first, int last);
  void try_triangles(const Eigen::Vector3d& query, int first, int count, Hit* best) const;

  std::vector<Triangle> triangles_;  // in the leaves' order
  std::vector<int> faces_;           // of each of them
  std::vector<int> place_;           // of each face, -1: left out
  std::vector<Node> nodes_;
  double noise_ = 0;  // of a squared distance, mm^2: boxes are not refused over so little
};

}  // namespace facewright
