// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/uv/scaling.h"

#include <Spectra/MatOp/DenseSymMatProd.h>
#include <Spectra/SymEigsSolver.h>

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

constexpr int kDenseLimit = 40;  // below, all eigenpairs cost nothing and Lanczos has no room

struct Pairs {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};

Pairs leading_three(const Eigen::MatrixXd& B) {
  if (B.rows() <= kDenseLimit) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> dense(B);
    return {dense.eigenvalues().reverse().head(3), dense.eigenvectors().rowwise().reverse().leftCols(3)};
  }
  Spectra::DenseSymMatProd<double> product(B);
  Spectra::SymEigsSolver<Spectra::DenseSymMatProd<double>> lanczos(product, 3, 20);
  lanczos.init();
  lanczos.compute(Spectra::SortRule::LargestAlge, 1000, 1e-12);
  if (lanczos.info() != Spectra::CompInfo::Successful) throw SolverError("isomap: the eigenvalues did not converge");
  return {lanczos.eigenvalues(), lanczos.eigenvectors()};
}

}  // namespace

ScalingResult landmark_scaling(const Eigen::MatrixXd& D, const std::vector<int>& landmarks) {
  const Eigen::Index m = D.rows();
  if (m < 4) throw InvalidInput("isomap: needs at least 4 points, got " + std::to_string(m));
  Eigen::MatrixXd squared(m, m);
  for (Eigen::Index j = 0; j < m; ++j) squared.col(j) = D.col(landmarks[static_cast<size_t>(j)]).cwiseAbs2();
  squared = (0.5 * (squared + squared.transpose())).eval();
  const Eigen::VectorXd mean = squared.rowwise().mean();
  const Eigen::MatrixXd B =
      -0.5 * ((squared.colwise() - mean).rowwise() - mean.transpose()).array() - 0.5 * mean.mean();  // -1/2 J D^2 J
  const Pairs pairs = leading_three(B);
  if (!(pairs.values[1] > 0)) throw InvalidInput("isomap: the points lie on a line");
  // x = -1/2 pinv(L) (d_x^2 - mean d^2) with L = eigenvectors * sqrt(eigenvalues)
  const Eigen::MatrixXd pinv =
      pairs.values.head(2).cwiseSqrt().cwiseInverse().asDiagonal() * pairs.vectors.leftCols(2).transpose();
  ScalingResult result;
  result.points = (-0.5 * pinv * (D.cwiseAbs2().colwise() - mean)).transpose();
  result.third_eigenvalue_share = std::max(0.0, pairs.values[2]) / pairs.values[0];
  return result;
}

}  // namespace facewright
