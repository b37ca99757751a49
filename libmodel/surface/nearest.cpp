// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/surface/nearest.h"

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/surface/triangle_tree.h"

namespace facewright {

struct SurfaceIndex::Tree {
  const Vertices V;
  const Faces F;
  const TriangleTree triangles;

  Tree(const Vertices& vertices, const Faces& faces) : V(vertices), F(faces), triangles(V, F) {}

  NearestPoint describe(const TriangleTree::Hit& hit, const Eigen::Vector3d& query) const {
    NearestPoint result;
    result.where = {hit.face, hit.barycentric};
    result.position = facewright::position(result.where, V, F);
    result.distance = (result.position - query).norm();
    return result;
  }
};

SurfaceIndex::SurfaceIndex(const Vertices& V, const Faces& F) : tree_(std::make_unique<Tree>(V, F)) {
  if (tree_->triangles.empty()) throw InvalidInput("surface index: the mesh has no triangle with an area");
}
SurfaceIndex::~SurfaceIndex() = default;
SurfaceIndex::SurfaceIndex(SurfaceIndex&&) noexcept = default;
SurfaceIndex& SurfaceIndex::operator=(SurfaceIndex&&) noexcept = default;

NearestPoint SurfaceIndex::nearest(const Eigen::Vector3d& query, int hint) const {
  return tree_->describe(tree_->triangles.nearest(query, hint), query);
}

std::vector<NearestPoint> SurfaceIndex::nearest(const Vertices& queries, int threads) const {
  std::vector<NearestPoint> result(static_cast<size_t>(queries.rows()));
  parallel_blocks(static_cast<int>(queries.rows()), threads, [&](int first, int last) {
    for (int i = first; i < last; ++i) result[static_cast<size_t>(i)] = nearest(queries.row(i).transpose().eval());
  });
  return result;
}

std::optional<NearestPoint> SurfaceIndex::first_hit(const Eigen::Vector3d& origin,
                                                    const Eigen::Vector3d& direction) const {
  const auto hit = tree_->triangles.first_hit(origin, direction);
  if (!hit) return {};
  return tree_->describe(*hit, origin);
}

}  // namespace facewright
