// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/geometry/laplacian.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "libmodel/core/topology.h"

namespace facewright {
namespace {

double cotangent_at(const Eigen::Vector3d& apex, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d u = a - apex, v = b - apex;
  const double area2 = u.cross(v).norm();
  return area2 > 1e-12 ? u.dot(v) / area2 : 0;
}

int opposite(const Faces& F, int f, int v0, int v1) {
  for (int k = 0; k < 3; ++k)
    if (F(f, k) != v0 && F(f, k) != v1) return F(f, k);
  return F(f, 0);
}

}  // namespace

Eigen::SparseMatrix<double> cotangent_stiffness(const Vertices& V, const Faces& F, const CotangentOptions& options) {
  std::vector<Eigen::Triplet<double>> entries;
  for (const Edge& e : edges(F)) {
    double w = 0;
    for (const int f : {e.f0, e.f1})
      if (f >= 0) w += 0.5 * cotangent_at(V.row(opposite(F, f, e.v0, e.v1)), V.row(e.v0), V.row(e.v1));
    w = std::clamp(w, options.lowest, options.highest);
    entries.emplace_back(e.v0, e.v1, -w);
    entries.emplace_back(e.v1, e.v0, -w);
    entries.emplace_back(e.v0, e.v0, w);
    entries.emplace_back(e.v1, e.v1, w);
  }
  Eigen::SparseMatrix<double> L(V.rows(), V.rows());
  L.setFromTriplets(entries.begin(), entries.end());
  return L;
}

}  // namespace facewright
