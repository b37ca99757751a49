// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/pca.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <string>

#include "libmodel/building/eigen_pairs.h"
#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

constexpr Eigen::Index kTile = 64;       // scans per tile of the Gram matrix: the unit of parallel work
constexpr Eigen::Index kColumns = 8192;  // columns per block, so that two tiles stay in the cache
constexpr double kRelativeFloor =
    1e-12;  // variance below this share of the first mode's is rounding of the Gram matrix
constexpr double kRoundingFloor = 1e-24;  // (1e-12)^2: variance below this share of |mean|^2 is rounding of the data

void check(const SampleMatrix& X, const PcaOptions& options) {
  if (X.rows() == 0 || X.cols() == 0) throw InvalidInput("pca: there are no samples");
  if (!(options.variance_share > 0 && options.variance_share <= 1))
    throw InvalidInput("pca: variance_share is " + std::to_string(options.variance_share) +
                       "; expected 0 < share <= 1");
  for (Eigen::Index i = 0; i < X.rows(); ++i)
    if (!X.row(i).allFinite())
      throw InvalidInput("pca: sample " + std::to_string(i) + " of the set holds NaN or infinity");
}

Eigen::MatrixXd centred_block(const SampleMatrix& X, const Eigen::RowVectorXd& mean, Eigen::Index row,
                              Eigen::Index rows, Eigen::Index col, Eigen::Index cols) {
  return X.block(row, col, rows, cols).rowwise() - mean.segment(col, cols);
}

// Number of leading values whose sum reaches the share of the total.
int modes_for_share(const Eigen::VectorXd& values, double wanted) {
  double sum = 0;
  for (Eigen::Index k = 0; k < values.size(); ++k)
    if ((sum += values[k]) >= wanted) return static_cast<int>(k) + 1;
  return static_cast<int>(values.size());
}

// Eigenpairs of the covariance's Gram matrix, enough for the share.
EigenPairs decompose(const Eigen::MatrixXd& G, double wanted, const PcaOptions& options) {
  const int n = static_cast<int>(G.rows());
  if (n <= options.dense_limit) return all_eigenpairs(G);
  for (int k = std::min(n - 1, 300);; k = std::min(n - 1, 2 * k)) {
    EigenPairs pairs = leading_eigenpairs(G, k);
    if (pairs.values.sum() >= wanted || k == n - 1 || (options.max_modes >= 0 && k >= options.max_modes)) return pairs;
  }
}

// (D x K) basis = C^T Q / |.|, by blocks of rows.
Eigen::MatrixXd lift(const SampleMatrix& X, const Eigen::RowVectorXd& mean, const Eigen::MatrixXd& W, int threads) {
  Eigen::MatrixXd basis(X.cols(), W.cols());
  const int blocks = static_cast<int>((X.cols() + kColumns - 1) / kColumns);
  parallel_for(blocks, threads, [&](int b) {
    const Eigen::Index col = b * kColumns, cols = std::min(kColumns, X.cols() - col);
    basis.middleRows(col, cols).noalias() = centred_block(X, mean, 0, X.rows(), col, cols).transpose() * W;
  });
  return basis;
}

// The Gram matrix squares the condition number, so small modes are not quite orthogonal: one Cholesky QR mends that.
void orthonormalise(Eigen::MatrixXd& basis) {
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(basis.cols(), basis.cols());
  G.selfadjointView<Eigen::Lower>().rankUpdate(basis.transpose());
  const Eigen::LLT<Eigen::MatrixXd> llt(G.selfadjointView<Eigen::Lower>());
  if (llt.info() != Eigen::Success) throw SolverError("pca: the basis is not of full rank");
  llt.matrixU().solveInPlace<Eigen::OnTheRight>(basis);
}

void fix_signs(PcaResult& result) {
  for (Eigen::Index k = 0; k < result.model.basis.cols(); ++k) {
    Eigen::Index largest = 0;
    result.model.basis.col(k).cwiseAbs().maxCoeff(&largest);
    if (result.model.basis(largest, k) > 0) continue;
    result.model.basis.col(k) *= -1;
    result.scores.col(k) *= -1;
  }
}

}  // namespace

Eigen::MatrixXd gram_matrix(const SampleMatrix& X, const Eigen::RowVectorXd& mean, int threads) {
  const Eigen::Index n = X.rows(), tiles = (n + kTile - 1) / kTile;
  Eigen::MatrixXd G(n, n);
  parallel_for(static_cast<int>(tiles * (tiles + 1) / 2), threads, [&](int pair) {
    Eigen::Index i = 0;
    while ((i + 1) * (i + 2) / 2 <= pair) ++i;
    const Eigen::Index j = pair - i * (i + 1) / 2;
    const Eigen::Index row_i = i * kTile, rows_i = std::min(kTile, n - row_i);
    const Eigen::Index row_j = j * kTile, rows_j = std::min(kTile, n - row_j);
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(rows_i, rows_j);
    for (Eigen::Index col = 0; col < X.cols(); col += kColumns) {
      const Eigen::Index cols = std::min(kColumns, X.cols() - col);
      const Eigen::MatrixXd A = centred_block(X, mean, row_i, rows_i, col, cols);
      if (i == j)
        sum.noalias() += A * A.transpose();
      else
        sum.noalias() += A * centred_block(X, mean, row_j, rows_j, col, cols).transpose();
    }
    G.block(row_i, row_j, rows_i, rows_j) = sum;
    if (i != j) G.block(row_j, row_i, rows_j, rows_i) = sum.transpose();
  });
  return G;
}

PcaResult fit_pca(const SampleMatrix& X, const PcaOptions& options) {
  check(X, options);
  const Eigen::Index n = X.rows();
  const Eigen::RowVectorXd mean = X.colwise().mean();
  PcaResult result;
  result.summary.scan_count = static_cast<int>(n);
  result.summary.options = options;
  result.model = {mean.transpose(), Eigen::MatrixXd(X.cols(), 0), Eigen::VectorXd(0), true};
  result.scores.resize(n, 0);
  if (n == 1) return result;

  const Eigen::MatrixXd G = gram_matrix(X, mean, options.threads) / static_cast<double>(n - 1);
  const double total = G.trace(), wanted = options.variance_share * total;
  result.summary.total_variance = total;
  const EigenPairs pairs = decompose(G, wanted, options);
  const double floor = std::max(kRelativeFloor * pairs.values[0], kRoundingFloor * mean.squaredNorm());
  const Eigen::Index rank = std::min<Eigen::Index>(n - 1, (pairs.values.array() > floor).count());
  Eigen::Index k = std::min<Eigen::Index>(rank, modes_for_share(pairs.values, wanted));
  if (options.max_modes >= 0) k = std::min<Eigen::Index>(k, options.max_modes);
  result.summary.rank = static_cast<int>(rank);
  result.summary.mode_count = static_cast<int>(k);
  if (k == 0) return result;

  const double root = std::sqrt(static_cast<double>(n - 1));
  result.model.variances = pairs.values.head(k);
  const Eigen::VectorXd inverse_norms = (root * result.model.variances.cwiseSqrt()).cwiseInverse();
  result.model.basis = lift(X, mean, pairs.vectors.leftCols(k) * inverse_norms.asDiagonal(), options.threads);
  orthonormalise(result.model.basis);
  result.scores = pairs.vectors.leftCols(k) * root;
  fix_signs(result);
  result.summary.kept_variance = result.model.variances.sum();
  return result;
}

}  // namespace facewright
