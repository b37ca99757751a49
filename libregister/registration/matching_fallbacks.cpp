// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// The geometry behind the fallbacks of local matching: symmetry plane and harmonic fill.
#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <algorithm>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/geometry/laplacian.h"
#include "libregister/registration/matching.h"

namespace facewright {

SymmetryPlane symmetry_plane(const Vertices& V, const std::vector<int>& mirror) {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Eigen::Vector3d across = Eigen::Vector3d::Zero();
  for (int i = 0; i < V.rows(); ++i) {
    const int j = mirror[static_cast<size_t>(i)];
    if (j <= i || j >= V.rows()) continue;
    const Eigen::Vector3d d = (V.row(i) - V.row(j)).transpose();
    const Eigen::Vector3d u = across.dot(d) < 0 ? Eigen::Vector3d(-d) : d;
    spread += d * d.transpose();
    across += u;
  }
  if (across.squaredNorm() == 0) throw InvalidInput("symmetry plane: the reference has no left-right pairs");
  SymmetryPlane plane;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(spread);
  plane.normal = eigen.eigenvectors().col(2);
  if (plane.normal.dot(across) < 0) plane.normal = -plane.normal;
  std::vector<double> offsets;
  for (int i = 0; i < V.rows(); ++i) {
    const int j = mirror[static_cast<size_t>(i)];
    if (j >= i && j < V.rows()) offsets.push_back(plane.normal.dot(0.5 * (V.row(i) + V.row(j)).transpose()));
  }
  const auto mid = offsets.begin() + static_cast<std::ptrdiff_t>(offsets.size() / 2);
  std::nth_element(offsets.begin(), mid, offsets.end());
  plane.offset = *mid;
  return plane;
}

Vertices fill_harmonic(const Vertices& V, const Faces& F, const Vertices& field, const std::vector<bool>& known) {
  const Components components = connected_components(V.rows(), F);
  std::vector<bool> anchored(static_cast<size_t>(components.count), false);
  for (int i = 0; i < V.rows(); ++i)
    if (known[static_cast<size_t>(i)]) anchored[components.vertex_label[i]] = true;
  std::vector<int> unknown, slot(static_cast<size_t>(V.rows()), -1);
  Vertices result = field;
  for (int i = 0; i < V.rows(); ++i) {
    if (known[static_cast<size_t>(i)]) continue;
    result.row(i).setZero();
    if (!anchored[components.vertex_label[i]]) continue;
    slot[i] = static_cast<int>(unknown.size());
    unknown.push_back(i);
  }
  if (unknown.empty()) return result;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixXd rhs = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(unknown.size()), 3);
  for (const Edge& e : edges(F)) {
    const int s0 = slot[e.v0], s1 = slot[e.v1];
    if (s0 < 0 && s1 < 0) continue;
    const double w = cotangent_weight(V, F, e);
    if (s0 >= 0) entries.emplace_back(s0, s0, w);
    if (s1 >= 0) entries.emplace_back(s1, s1, w);
    if (s0 >= 0 && s1 >= 0)
      entries.emplace_back(std::max(s0, s1), std::min(s0, s1), -w);  // the lower half will do
    else if (s0 >= 0)
      rhs.row(s0) += w * field.row(e.v1);
    else
      rhs.row(s1) += w * field.row(e.v0);
  }
  Eigen::SparseMatrix<double> A(rhs.rows(), rhs.rows());
  A.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(A);
  if (solver.info() != Eigen::Success) throw SolverError("harmonic fill: the factorisation failed");
  const Eigen::MatrixXd x = solver.solve(rhs);
  for (size_t u = 0; u < unknown.size(); ++u) result.row(unknown[u]) = x.row(static_cast<Eigen::Index>(u));
  return result;
}

}  // namespace facewright
