// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/pca.h"

#include <algorithm>
#include <vector>

#include "libmodel/building/column_blocks.h"
#include "libmodel/building/principal_modes.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

// (D x K) basis = C'W of the centred samples C, by blocks of columns.
Eigen::MatrixXd lift(const SampleMatrix& X, const Eigen::RowVectorXd& mean, const Eigen::MatrixXd& W, int threads) {
  Eigen::MatrixXd basis(X.cols(), W.cols());
  parallel_for(column_block_count(X.cols()), threads, [&](int b) {
    const auto [col, cols] = column_block(X.cols(), b);
    const SampleMatrix C = X.middleCols(col, cols).rowwise() - mean.segment(col, cols);
    basis.middleRows(col, cols).noalias() = C.transpose() * W;
  });
  return basis;
}

// CC'Q / (n - 1) without CC'; the parts of the columns are summed in their order.
Eigen::MatrixXd gram_product(const SampleMatrix& X, const Eigen::RowVectorXd& mean, const Eigen::MatrixXd& Q,
                             int threads) {
  const int blocks = column_block_count(X.cols()), parts = std::min(16, blocks);
  std::vector<Eigen::MatrixXd> sums(static_cast<size_t>(parts));
  parallel_for(parts, threads, [&](int part) {
    Eigen::MatrixXd& sum = sums[static_cast<size_t>(part)];
    sum.setZero(Q.rows(), Q.cols());
    for (int b = blocks * part / parts; b < blocks * (part + 1) / parts; ++b) {
      const auto [col, cols] = column_block(X.cols(), b);
      const SampleMatrix C = X.middleCols(col, cols).rowwise() - mean.segment(col, cols);
      sum.noalias() += C * (C.transpose() * Q).eval();
    }
  });
  for (int part = 1; part < parts; ++part) sums[0] += sums[static_cast<size_t>(part)];
  return sums[0] / static_cast<double>(X.rows() - 1);
}

double total_variance(const SampleMatrix& X, const Eigen::RowVectorXd& mean, int threads) {
  Eigen::VectorXd squares(X.rows());
  parallel_for(static_cast<int>(X.rows()), threads, [&](int i) { squares[i] = (X.row(i) - mean).squaredNorm(); });
  return squares.sum() / static_cast<double>(X.rows() - 1);
}

}  // namespace

PcaResult fit_pca(const SampleMatrix& X, const PcaOptions& options) {
  check_pca_options(options);
  const Eigen::RowVectorXd mean = mean_sample(X, options.threads);
  PcaResult result = pca_without_modes(mean, X.rows(), options);
  if (X.rows() == 1) return result;
  EigenPairs pairs;
  double total = 0;
  if (options.solver == PcaSolver::randomised) {
    total = total_variance(X, mean, options.threads);
    const auto product = [&](const Eigen::MatrixXd& Q) { return gram_product(X, mean, Q, options.threads); };
    pairs = random_eigenpairs(product, X.rows(), options.variance_share * total, options.max_modes,
                              options.power_iterations);
    result.summary.solver = PcaSolver::randomised;
  }
  if (pairs.values.size() == 0) {
    const Eigen::MatrixXd G = gram_matrix(X, mean, options.threads) / static_cast<double>(X.rows() - 1);
    total = G.trace();
    pairs = gram_eigenpairs(G, options, &result.summary);
  }
  result.model.basis = lift(X, mean, choose_modes(pairs, total, &result), options.threads);
  finish_basis(&result, options.threads);
  return result;
}

}  // namespace facewright
