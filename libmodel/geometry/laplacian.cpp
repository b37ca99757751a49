// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/geometry/laplacian.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

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

double cotangent_weight(const Vertices& V, const Faces& F, const Edge& e, const CotangentOptions& options) {
  double w = 0;
  for (const int f : {e.f0, e.f1})
    if (f >= 0) w += 0.5 * cotangent_at(V.row(opposite(F, f, e.v0, e.v1)), V.row(e.v0), V.row(e.v1));
  return std::clamp(w, options.lowest, options.highest);
}

Eigen::SparseMatrix<double> cotangent_stiffness(const Vertices& V, const Faces& F, const CotangentOptions& options) {
  return cotangent_stiffness(V, F, edges(F), options);
}

Eigen::SparseMatrix<double> cotangent_stiffness(const Vertices& V, const Faces& F, const std::vector<Edge>& edge_list,
                                                const CotangentOptions& options) {
  // The edges are sorted, so that every column can be written from top to bottom: neighbours before the vertex, itself,
  // neighbours after it.
  Eigen::SparseMatrix<double> L(V.rows(), V.rows());
  Eigen::VectorXi entries = Eigen::VectorXi::Ones(V.rows());
  for (const Edge& e : edge_list) ++entries[e.v0], ++entries[e.v1];
  int* const outer = L.outerIndexPtr();
  for (Eigen::Index c = 0; c < V.rows(); ++c) outer[c + 1] = outer[c] + entries[c];
  L.resizeNonZeros(outer[V.rows()]);
  std::vector<int> next(outer, outer + V.rows());
  const auto write = [&](int column, int row, double value) {
    const int at = next[static_cast<size_t>(column)]++;
    L.innerIndexPtr()[at] = row;
    L.valuePtr()[at] = value;
  };
  Eigen::VectorXd w(static_cast<Eigen::Index>(edge_list.size())), diagonal = Eigen::VectorXd::Zero(V.rows());
  for (Eigen::Index k = 0; k < w.size(); ++k) {
    const Edge& e = edge_list[static_cast<size_t>(k)];
    w[k] = cotangent_weight(V, F, e, options);
    diagonal[e.v0] += w[k], diagonal[e.v1] += w[k];
    write(e.v1, e.v0, -w[k]);
  }
  for (int c = 0; c < V.rows(); ++c) write(c, c, diagonal[c]);
  for (Eigen::Index k = 0; k < w.size(); ++k)
    write(edge_list[static_cast<size_t>(k)].v0, edge_list[static_cast<size_t>(k)].v1, -w[k]);
  return L;
}

}  // namespace facewright
