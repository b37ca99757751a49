// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <limits>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// A k-d tree over points [bentley1975]: nearest points of a fixed set. Keeps a copy of the points. Equal distances go
/// to the lower row, so that answers do not depend on the tree.
class PointTree {
 public:
  /// O(N log N).
  explicit PointTree(const Vertices& points);

  struct Neighbour {
    int row = -1;  ///< -1: none within the bound
    double squared_distance = std::numeric_limits<double>::infinity();
  };
  /// The nearest point closer than `bound` (same unit as the points).
  Neighbour nearest(const Eigen::Vector3d& query, double bound = std::numeric_limits<double>::infinity()) const;
  /// The k nearest, nearest first; fewer if there are fewer points.
  std::vector<Neighbour> nearest(const Eigen::Vector3d& query, int k) const;

 private:
  struct Node {
    int first = 0, last = 0;  ///< range of order_
    int axis = -1;            ///< -1: a leaf
    int left = -1, right = -1;
    double split = 0;
  };
  int build(int first, int last);

  Vertices points_;         ///< in the tree's order
  std::vector<int> order_;  ///< row of the i-th of points_
  std::vector<Node> nodes_;
};

}  // namespace facewright
