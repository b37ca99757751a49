// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/surface/nearest.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include <Eigen/Geometry>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Aabb = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 to_cgal(const Eigen::Vector3d& p) { return {p[0], p[1], p[2]}; }
Eigen::Vector3d to_eigen(const Kernel::Point_3& p) { return {p.x(), p.y(), p.z()}; }

}  // namespace

struct SurfaceIndex::Tree {
  Triangles triangles;
  std::vector<int> face;  // of each triangle kept
  Aabb aabb;

  NearestPoint describe(const Eigen::Vector3d& query, const Eigen::Vector3d& q, Triangles::const_iterator it) const {
    const auto& t = *it;
    NearestPoint result;
    result.where.triangle = face[static_cast<size_t>(it - triangles.begin())];
    result.where.barycentric = nearest_on_triangle(q, to_eigen(t[0]), to_eigen(t[1]), to_eigen(t[2]));
    result.position = result.where.barycentric[0] * to_eigen(t[0]) + result.where.barycentric[1] * to_eigen(t[1]) +
                      result.where.barycentric[2] * to_eigen(t[2]);
    result.distance = (result.position - query).norm();
    return result;
  }
};

SurfaceIndex::SurfaceIndex(const Vertices& V, const Faces& F) : tree_(std::make_unique<Tree>()) {
  for (int f = 0; f < F.rows(); ++f) {
    const Eigen::Vector3d a = V.row(F(f, 0)), b = V.row(F(f, 1)), c = V.row(F(f, 2));
    const Eigen::Vector3d u = b - a, v = c - a;
    const double area2 = (u.cross(v)).norm();
    if (!(area2 > 1e-12)) continue;
    tree_->triangles.emplace_back(to_cgal(a), to_cgal(b), to_cgal(c));
    tree_->face.push_back(f);
  }
  if (tree_->triangles.empty()) throw InvalidInput("surface index: the mesh has no triangle with an area");
  tree_->aabb.insert(tree_->triangles.cbegin(), tree_->triangles.cend());
  tree_->aabb.build();
  tree_->aabb.accelerate_distance_queries();
}
SurfaceIndex::~SurfaceIndex() = default;
SurfaceIndex::SurfaceIndex(SurfaceIndex&&) noexcept = default;
SurfaceIndex& SurfaceIndex::operator=(SurfaceIndex&&) noexcept = default;

NearestPoint SurfaceIndex::nearest(const Eigen::Vector3d& query) const {
  const auto [point, it] = tree_->aabb.closest_point_and_primitive(to_cgal(query));
  return tree_->describe(query, to_eigen(point), it);
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
  const Kernel::Ray_3 ray(to_cgal(origin), Kernel::Vector_3(direction[0], direction[1], direction[2]));
  const auto found = tree_->aabb.first_intersection(ray);
  if (!found) return {};
  const auto* point = boost::get<Kernel::Point_3>(&found->first);
  if (!point) return {};
  return tree_->describe(origin, to_eigen(*point), found->second);
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
