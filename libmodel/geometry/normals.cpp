// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/geometry/normals.h"

#include <Eigen/Geometry>

namespace facewright {
namespace {

// Twice the area times the unit normal.
Eigen::RowVector3d area_vector(const Vertices& V, const Faces& F, Eigen::Index f) {
  const Eigen::RowVector3d a = V.row(F(f, 0)), b = V.row(F(f, 1)), c = V.row(F(f, 2));
  return (b - a).cross(c - a);
}

void normalise_rows(Vertices& N) {
  for (Eigen::Index i = 0; i < N.rows(); ++i) {
    const double length = N.row(i).norm();
    if (length > 0) N.row(i) /= length;
  }
}

}  // namespace

Vertices face_normals(const Vertices& V, const Faces& F) {
  Vertices N(F.rows(), 3);
  for (Eigen::Index f = 0; f < F.rows(); ++f) N.row(f) = area_vector(V, F, f);
  normalise_rows(N);
  return N;
}

Eigen::VectorXd face_areas(const Vertices& V, const Faces& F) {
  Eigen::VectorXd A(F.rows());
  for (Eigen::Index f = 0; f < F.rows(); ++f) A[f] = 0.5 * area_vector(V, F, f).norm();
  return A;
}

Vertices vertex_normals(const Vertices& V, const Faces& F) {
  Vertices N = Vertices::Zero(V.rows(), 3);
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const Eigen::RowVector3d n = area_vector(V, F, f);
    for (int k = 0; k < 3; ++k) N.row(F(f, k)) += n;
  }
  normalise_rows(N);
  return N;
}

Eigen::VectorXd vertex_areas(const Vertices& V, const Faces& F) {
  Eigen::VectorXd A = Eigen::VectorXd::Zero(V.rows());
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const double third = area_vector(V, F, f).norm() / 6;
    for (int k = 0; k < 3; ++k) A[F(f, k)] += third;
  }
  return A;
}

double mean_edge_length(const Vertices& V, const Faces& F) {
  double sum = 0;
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) sum += (V.row(F(f, k)) - V.row(F(f, (k + 1) % 3))).norm();
  return F.rows() > 0 ? sum / static_cast<double>(F.size()) : 0;
}

Eigen::VectorXd vertex_edge_lengths(const Vertices& V, const Faces& F) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(V.rows()), count = Eigen::VectorXd::Zero(V.rows());
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      const int a = F(f, k), b = F(f, (k + 1) % 3);
      const double length = (V.row(a) - V.row(b)).norm();
      sum[a] += length, sum[b] += length;
      count[a] += 1, count[b] += 1;
    }
  return (count.array() > 0).select(sum.array() / count.array().max(1.0), 0.0);
}

}  // namespace facewright
