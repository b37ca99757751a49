// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/principal_modes.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <string>

#include "libmodel/building/column_blocks.h"
#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

constexpr int kDenseLimit = 400;  // samples; from here on Lanczos is the faster
constexpr double kRelativeFloor =
    1e-12;  // variance below this share of the first mode's is rounding of the Gram matrix
constexpr double kRoundingFloor = 1e-24;  // (1e-12)^2: variance below this share of |mean|^2 is rounding of the data
constexpr int kParts = 32;                // parts of the columns, whose sums are added in their order

// Number of leading values whose sum reaches the share of the total.
Eigen::Index modes_for_share(const Eigen::VectorXd& values, double wanted) {
  double sum = 0;
  for (Eigen::Index k = 0; k < values.size(); ++k)
    if ((sum += values[k]) >= wanted) return k + 1;
  return values.size();
}

// B'B, by parts of the rows.
Eigen::MatrixXd inner_products(const Eigen::MatrixXd& B, int threads) {
  const int blocks = column_block_count(B.rows()), parts = std::min(kParts, blocks);
  std::vector<Eigen::MatrixXd> sums(static_cast<size_t>(parts));
  parallel_for(parts, threads, [&](int part) {
    Eigen::MatrixXd& sum = sums[static_cast<size_t>(part)];
    sum.setZero(B.cols(), B.cols());
    for (int b = blocks * part / parts; b < blocks * (part + 1) / parts; ++b) {
      const auto [row, rows] = column_block(B.rows(), b);
      sum.selfadjointView<Eigen::Lower>().rankUpdate(B.middleRows(row, rows).transpose());
    }
  });
  for (int part = 1; part < parts; ++part) sums[0] += sums[static_cast<size_t>(part)];
  return sums[0];
}

void fix_signs(PcaResult* result, int threads) {
  parallel_for(static_cast<int>(result->model.basis.cols()), threads, [&](int k) {
    auto mode = result->model.basis.col(k);
    Eigen::Index largest = 0;
    mode.cwiseAbs().maxCoeff(&largest);
    if (mode[largest] > 0) return;
    mode *= -1;
    result->scores.col(k) *= -1;
  });
}

}  // namespace

void check_pca_options(const PcaOptions& options) {
  if (!(options.variance_share > 0 && options.variance_share <= 1))
    throw InvalidInput("pca: variance_share is " + std::to_string(options.variance_share) +
                       "; expected 0 < share <= 1");
  if (options.power_iterations < 2 || options.power_iterations > 10)
    throw InvalidInput("pca: power_iterations is " + std::to_string(options.power_iterations) + "; expected 2 to 10");
}

PcaResult pca_without_modes(const Eigen::RowVectorXd& mean, Eigen::Index n, const PcaOptions& options) {
  PcaResult result;
  result.model = {mean.transpose(), Eigen::MatrixXd(mean.size(), 0), Eigen::VectorXd(0), true};
  result.scores.resize(n, 0);
  result.summary.scan_count = static_cast<int>(n);
  result.summary.options = options;
  return result;
}

EigenPairs gram_eigenpairs(const Eigen::MatrixXd& G, const PcaOptions& options, PcaSummary* summary) {
  const bool lanczos =
      options.solver == PcaSolver::lanczos || (options.solver == PcaSolver::automatic && G.rows() > kDenseLimit);
  EigenPairs pairs = lanczos
                         ? lanczos_eigenpairs(G, options.variance_share * G.trace(), options.max_modes, options.threads)
                         : all_eigenpairs(G);
  summary->solver = pairs.values.size() == G.rows() ? PcaSolver::gram : PcaSolver::lanczos;
  return pairs;
}

Eigen::MatrixXd choose_modes(const EigenPairs& pairs, double total, PcaResult* result) {
  PcaSummary& summary = result->summary;
  const Eigen::Index n = pairs.vectors.rows();
  const double floor = std::max(kRelativeFloor * pairs.values[0], kRoundingFloor * result->model.mean.squaredNorm());
  const Eigen::Index rank = std::min<Eigen::Index>(n - 1, (pairs.values.array() > floor).count());
  Eigen::Index k = std::min(rank, modes_for_share(pairs.values, summary.options.variance_share * total));
  if (summary.options.max_modes >= 0) k = std::min<Eigen::Index>(k, summary.options.max_modes);
  const double root = std::sqrt(static_cast<double>(n - 1));
  result->model.variances = pairs.values.head(k);
  result->scores = pairs.vectors.leftCols(k) * root;
  summary.total_variance = total;
  summary.kept_variance = result->model.variances.sum();
  summary.rank = static_cast<int>(rank);
  summary.mode_count = static_cast<int>(k);
  summary.iterations = pairs.iterations;
  summary.residual = pairs.residual;
  return pairs.vectors.leftCols(k) * (root * result->model.variances.cwiseSqrt()).cwiseInverse().asDiagonal();
}

void finish_basis(PcaResult* result, int threads) {
  Eigen::MatrixXd& basis = result->model.basis;
  if (basis.cols() == 0) return;
  const Eigen::LLT<Eigen::MatrixXd> llt(inner_products(basis, threads));
  if (llt.info() != Eigen::Success) throw SolverError("pca: the basis is not of full rank");
  parallel_for(column_block_count(basis.rows()), threads, [&](int b) {
    const auto [row, rows] = column_block(basis.rows(), b);
    auto block = basis.middleRows(row, rows);
    llt.matrixU().solveInPlace<Eigen::OnTheRight>(block);
  });
  fix_signs(result, threads);
}

}  // namespace facewright
