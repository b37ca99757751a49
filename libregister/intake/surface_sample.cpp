// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/surface_sample.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "libmodel/core/random.h"

namespace facewright {
namespace {

Eigen::Vector3d doubled_area_vector(const Vertices& V, const Faces& F, Eigen::Index f) {
  const Eigen::Vector3d a = V.row(F(f, 0));
  return (V.row(F(f, 1)).transpose() - a).cross(V.row(F(f, 2)).transpose() - a);
}

}  // namespace

SurfaceSample sample_surface(const Vertices& V, const Faces& F, int count) {
  double area = 0;
  for (Eigen::Index f = 0; f < F.rows(); ++f) area += doubled_area_vector(V, F, f).norm();
  SurfaceSample sample;
  if (!(area > 0) || !std::isfinite(area)) return sample;
  std::vector<Eigen::Vector3d> points, normals;
  Random random(1);
  const double step = area / count;
  double passed = 0, next = step / 2;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const Eigen::Vector3d n = doubled_area_vector(V, F, f);
    const double size = n.norm();
    for (passed += size; next < passed; next += step) {
      double u = random.uniform(), v = random.uniform();
      if (u + v > 1) u = 1 - u, v = 1 - v;
      points.emplace_back((1 - u - v) * V.row(F(f, 0)) + u * V.row(F(f, 1)) + v * V.row(F(f, 2)));
      normals.emplace_back(n / size);
      sample.triangle.push_back(static_cast<int>(f));
    }
  }
  const auto n = static_cast<Eigen::Index>(points.size());
  sample.P.resize(n, 3), sample.N.resize(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    sample.P.row(i) = points[static_cast<size_t>(i)].transpose();
    sample.N.row(i) = normals[static_cast<size_t>(i)].transpose();
  }
  return sample;
}

Vertices smooth_normals(const SurfaceSample& sample, double cell) {
  constexpr double kFarthest = 1e9;  // cells; farther points are damage, and together
  std::map<std::array<int, 3>, Eigen::Vector3d> sums;
  const auto key = [&](Eigen::Index i) {
    std::array<int, 3> k;
    for (int d = 0; d < 3; ++d)
      k[static_cast<size_t>(d)] =
          static_cast<int>(std::clamp(std::floor(sample.P(i, d) / cell), -kFarthest, kFarthest));
    return k;
  };
  for (Eigen::Index i = 0; i < sample.P.rows(); ++i)
    sums.try_emplace(key(i), Eigen::Vector3d::Zero()).first->second += sample.N.row(i).transpose();
  Vertices N(sample.N.rows(), 3);
  for (Eigen::Index i = 0; i < N.rows(); ++i) {
    const Eigen::Vector3d n = sums.at(key(i));
    N.row(i) = n.squaredNorm() > 0 ? Eigen::RowVector3d(n.normalized().transpose()) : sample.N.row(i).eval();
  }
  return N;
}

}  // namespace facewright
