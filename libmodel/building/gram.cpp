// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/gram.h"

#include <algorithm>
#include <string>

#include "libmodel/building/column_blocks.h"
#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

constexpr Eigen::Index kTile = 256;  // samples per tile: two tiles of a block of columns stay in the cache

}  // namespace

Eigen::RowVectorXd mean_sample(const SampleMatrix& X, int threads) {
  if (X.rows() == 0 || X.cols() == 0) throw InvalidInput("pca: there are no samples");
  Eigen::RowVectorXd mean(X.cols());
  parallel_for(column_block_count(X.cols()), threads, [&](int b) {
    const auto [col, cols] = column_block(X.cols(), b);
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(cols);
    for (Eigen::Index i = 0; i < X.rows(); ++i) sum += X.row(i).segment(col, cols);
    mean.segment(col, cols) = sum / static_cast<double>(X.rows());
  });
  if (mean.allFinite()) return mean;  // a single NaN or infinity would show
  for (Eigen::Index i = 0; i < X.rows(); ++i)
    if (!X.row(i).allFinite())
      throw InvalidInput("pca: sample " + std::to_string(i) + " of the set holds NaN or infinity");
  throw InvalidInput("pca: the samples are too large to be averaged");
}

Eigen::MatrixXd gram_matrix(const SampleMatrix& X, const Eigen::RowVectorXd& mean, int threads) {
  const Eigen::Index n = X.rows(), tiles = (n + kTile - 1) / kTile;
  const int pairs = static_cast<int>(tiles * (tiles + 1) / 2), blocks = column_block_count(X.cols());
  // Few tiles: the columns are shared out as well, in parts that do not depend on the number of threads.
  const int parts = std::clamp(32 / pairs, 1, blocks);
  std::vector<Eigen::MatrixXd> sums(static_cast<size_t>(pairs * parts));
  parallel_for(pairs * parts, threads, [&](int task) {
    const int pair = task / parts, part = task % parts;
    Eigen::Index i = 0;
    while ((i + 1) * (i + 2) / 2 <= pair) ++i;
    const Eigen::Index row_i = i * kTile, rows_i = std::min(kTile, n - row_i);
    const Eigen::Index row_j = (pair - i * (i + 1) / 2) * kTile, rows_j = std::min(kTile, n - row_j);
    Eigen::MatrixXd& sum = sums[static_cast<size_t>(task)];
    sum.setZero(rows_i, rows_j);
    SampleMatrix A, B;
    for (int b = blocks * part / parts; b < blocks * (part + 1) / parts; ++b) {
      const auto [col, cols] = column_block(X.cols(), b);
      A = X.block(row_i, col, rows_i, cols).rowwise() - mean.segment(col, cols);
      if (row_i == row_j) {
        sum.selfadjointView<Eigen::Lower>().rankUpdate(A);
      } else {
        B = X.block(row_j, col, rows_j, cols).rowwise() - mean.segment(col, cols);
        sum.noalias() += A * B.transpose();
      }
    }
  });
  Eigen::MatrixXd G(n, n);
  int task = 0;
  for (Eigen::Index row_i = 0; row_i < n; row_i += kTile)
    for (Eigen::Index row_j = 0; row_j <= row_i; row_j += kTile) {
      Eigen::MatrixXd& sum = sums[static_cast<size_t>(task++)];
      for (int part = 1; part < parts; ++part) sum += sums[static_cast<size_t>(task++)];
      G.block(row_i, row_j, sum.rows(), sum.cols()) = sum;
    }
  G.triangularView<Eigen::StrictlyUpper>() = G.transpose();
  return G;
}

Eigen::MatrixXd centred_gram(Eigen::MatrixXd G) {
  const double n = static_cast<double>(G.rows());
  const Eigen::VectorXd means = G.colwise().sum().transpose() / n;
  const double mean = means.sum() / n;
  for (Eigen::Index j = 0; j < G.cols(); ++j)
    for (Eigen::Index i = 0; i < G.rows(); ++i) G(i, j) += mean - (means[i] + means[j]);
  return G;
}

Eigen::MatrixXd gram_of(const Eigen::MatrixXd& G, const std::vector<int>& kept) { return G(kept, kept); }

}  // namespace facewright
