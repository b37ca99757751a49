// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/eigen_pairs.h"

#include <Spectra/MatOp/DenseSymMatProd.h>
#include <Spectra/SymEigsSolver.h>

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "libmodel/core/errors.h"

namespace facewright {

EigenPairs all_eigenpairs(const Eigen::MatrixXd& G) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(G);
  if (solver.info() != Eigen::Success) throw SolverError("pca: the eigenvalue iteration did not converge");
  return {solver.eigenvalues().reverse(), solver.eigenvectors().rowwise().reverse()};
}

EigenPairs leading_eigenpairs(const Eigen::MatrixXd& G, int k) {
  Spectra::DenseSymMatProd<double> product(G);
  const int n = static_cast<int>(G.rows());
  Spectra::SymEigsSolver<Spectra::DenseSymMatProd<double>> solver(product, k, std::min(n, 2 * k + 20));
  solver.init();
  solver.compute(Spectra::SortRule::LargestAlge, 1000, 1e-12);
  if (solver.info() != Spectra::CompInfo::Successful)
    throw SolverError("pca: only some of " + std::to_string(k) + " eigenpairs converged");
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace facewright
