// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <flann/flann.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/surface/nearest.h"

namespace facewright {

struct PointIndex::Tree {
  Vertices points;
  std::unique_ptr<flann::Index<flann::L2_3D<double>>> index;
};

PointIndex::PointIndex(const Vertices& points) : tree_(std::make_unique<Tree>()) {
  if (points.rows() == 0) throw InvalidInput("point index: there are no points");
  tree_->points = points;
  const flann::Matrix<double> data(tree_->points.data(), static_cast<size_t>(points.rows()), 3);
  tree_->index = std::make_unique<flann::Index<flann::L2_3D<double>>>(data, flann::KDTreeSingleIndexParams(10, false));
  tree_->index->buildIndex();
}
PointIndex::~PointIndex() = default;
PointIndex::PointIndex(PointIndex&&) noexcept = default;
PointIndex& PointIndex::operator=(PointIndex&&) noexcept = default;

std::vector<int> PointIndex::nearest(const Vertices& queries) const {
  std::vector<int> found(static_cast<size_t>(queries.rows()));
  std::vector<double> distances(found.size());
  const flann::Matrix<double> q(const_cast<double*>(queries.data()), found.size(), 3);
  flann::Matrix<int> indices(found.data(), found.size(), 1);
  flann::Matrix<double> d(distances.data(), found.size(), 1);
  tree_->index->knnSearch(q, indices, d, 1, flann::SearchParams(flann::FLANN_CHECKS_UNLIMITED));
  return found;
}

}  // namespace facewright
