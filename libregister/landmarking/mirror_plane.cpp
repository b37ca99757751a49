// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/mirror_plane.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

namespace facewright {
namespace {

struct Pair {
  Eigen::Vector3d point, image, normal;  // the point, what its mirror image met, and the normal there
  double distance;
};

std::vector<Pair> pairs(const MirrorPlane& plane, const Vertices& points, const Vertices& normals,
                        const PointIndex& index, const std::vector<int>& sample, double trimmed) {
  Vertices mirrored(static_cast<Eigen::Index>(sample.size()), 3);
  for (size_t i = 0; i < sample.size(); ++i)
    mirrored.row(static_cast<Eigen::Index>(i)) = plane.reflect(points.row(sample[i]));
  const std::vector<int> near = index.nearest(mirrored);
  std::vector<Pair> found;
  for (size_t i = 0; i < sample.size(); ++i) {
    const Eigen::Vector3d n = normals.row(sample[i]), m = normals.row(near[i]);
    if ((n - 2 * plane.normal.dot(n) * plane.normal).dot(m) < 0.5) continue;
    found.push_back({points.row(sample[i]), points.row(near[i]), m,
                     (mirrored.row(static_cast<Eigen::Index>(i)) - points.row(near[i])).norm()});
  }
  std::stable_sort(found.begin(), found.end(), [](const Pair& a, const Pair& b) { return a.distance < b.distance; });
  found.resize(static_cast<size_t>(std::floor(trimmed * static_cast<double>(found.size()))));
  return found;
}

}  // namespace

MirrorPlane refine_mirror_plane(const MirrorPlane& guess, const Vertices& points, const Vertices& normals,
                                const PointIndex& index, const std::vector<int>& sample,
                                const MirrorPlaneOptions& options) {
  MirrorPlane plane = guess;
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    const std::vector<Pair> matched = pairs(plane, points, normals, index, sample, options.trimmed);
    if (matched.size() < 20) return plane;
    const Eigen::Vector3d e1 = plane.normal.unitOrthogonal(), e2 = plane.normal.cross(e1);
    // Turning the plane about a point in its middle keeps turn and shift apart.
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const Pair& p : matched) middle += p.point / static_cast<double>(matched.size());
    middle -= (plane.normal.dot(middle) - plane.offset) * plane.normal;
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    double squares = 0;
    for (const Pair& p : matched) {
      const Eigen::Vector3d x = p.point - middle;
      const double height = plane.normal.dot(x);
      const auto motion = [&](const Eigen::Vector3d& dn) {
        return -2 * (x.dot(dn) * plane.normal + height * dn).dot(p.normal);
      };
      const Eigen::Vector3d J(motion(e1), motion(e2), 2 * plane.normal.dot(p.normal));
      const double r = p.normal.dot(p.image - plane.reflect(p.point));
      A += J * J.transpose();
      b += J * r;
      squares += r * r;
    }
    plane.residual = std::sqrt(squares / static_cast<double>(matched.size()));
    A.diagonal().array() += 1e-9 * A.trace();
    const Eigen::Vector3d step = A.ldlt().solve(b);
    plane.normal = (plane.normal + step[0] * e1 + step[1] * e2).normalized();
    plane.offset = plane.normal.dot(middle) + step[2];
    if (step.head<2>().norm() < 1e-5 && std::abs(step[2]) < 1e-3) break;
  }
  return plane;
}

}  // namespace facewright
