// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/eigen_pairs.h"

#include <Spectra/SymEigsSolver.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/core/random.h"

namespace facewright {
namespace {

constexpr double kNoise = 1e-12;                       // an eigenvalue below this share of the first is rounding
constexpr int kFirstLanczos = 64, kFirstRandom = 150;  // pairs tried first: a face model has 60 to 130 modes at 99 %
constexpr int kRestarts = 20;  // of Lanczos: what is not found by then lies in a dense part of the spectrum
constexpr int kOversampling = 20;
constexpr int kMostPowerIterations = 10;
constexpr double kResidual = 1e-10;
constexpr std::uint64_t kSeed = 20110217;

// Products with a symmetric matrix, in blocks of columns shared by the threads.
class SymmetricProduct {
 public:
  using Scalar = double;
  SymmetricProduct(const Eigen::MatrixXd& G, int threads) : G_(G), threads_(threads) {}
  Eigen::Index rows() const { return G_.rows(); }
  Eigen::Index cols() const { return G_.cols(); }
  void perform_op(const double* x, double* y) const {
    const Eigen::Map<const Eigen::VectorXd> in(x, G_.rows());
    Eigen::Map<Eigen::VectorXd> out(y, G_.rows());
    constexpr Eigen::Index block = 512;
    const int blocks = static_cast<int>((G_.rows() + block - 1) / block);
    parallel_for(blocks, blocks < 4 ? 1 : threads_, [&](int b) {
      const Eigen::Index first = b * block, count = std::min(block, G_.rows() - first);
      out.segment(first, count).noalias() = G_.middleCols(first, count).transpose() * in;
    });
  }

 private:
  const Eigen::MatrixXd& G_;
  int threads_;
};

bool enough(const Eigen::VectorXd& values, double wanted, double total) {
  return values.sum() >= wanted || total - values.sum() <= kNoise * values[0] * static_cast<double>(values.size());
}

}  // namespace

EigenPairs all_eigenpairs(const Eigen::MatrixXd& G) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(G);
  if (solver.info() != Eigen::Success) throw SolverError("pca: the eigenvalue iteration did not converge");
  return {solver.eigenvalues().reverse(), solver.eigenvectors().rowwise().reverse()};
}

EigenPairs lanczos_eigenpairs(const Eigen::MatrixXd& G, double wanted, int max_pairs, int threads) {
  const int n = static_cast<int>(G.rows());
  const double total = G.trace();
  SymmetricProduct product(G, threads);
  for (int k = max_pairs >= 0 ? std::max(1, max_pairs) : kFirstLanczos; k < n / 2; k *= 2) {
    Spectra::SymEigsSolver<SymmetricProduct> solver(product, k, std::min(n, 2 * k + 20));
    solver.init();
    solver.compute(Spectra::SortRule::LargestAlge, kRestarts, 1e-11);
    // Where the rank is below k, the pairs without variance need not converge.
    EigenPairs pairs{solver.eigenvalues(), solver.eigenvectors(), static_cast<int>(solver.num_iterations())};
    if (pairs.values.size() == 0) break;
    if (enough(pairs.values, wanted, total) || (pairs.values.size() == k && k == max_pairs)) return pairs;
    if (pairs.values.size() < k) break;
  }
  const auto block_product = [&](const Eigen::MatrixXd& Q) {
    Eigen::MatrixXd Y(n, Q.cols());
    parallel_for(static_cast<int>(Q.cols() + 31) / 32, threads, [&](int b) {
      const Eigen::Index first = 32 * b, count = std::min<Eigen::Index>(32, Q.cols() - first);
      Y.middleCols(first, count).noalias() = G * Q.middleCols(first, count);
    });
    return Y;
  };
  const EigenPairs pairs = random_eigenpairs(block_product, n, wanted, max_pairs, 2);
  return pairs.values.size() > 0 ? pairs : all_eigenpairs(G);
}

EigenPairs random_eigenpairs(const std::function<Eigen::MatrixXd(const Eigen::MatrixXd&)>& G, Eigen::Index n,
                             double wanted, int max_pairs, int power_iterations) {
  Random random(kSeed);
  Eigen::MatrixXd Q(n, 0);
  EigenPairs pairs;
  for (Eigen::Index k = max_pairs >= 0 ? std::max(1, max_pairs) : kFirstRandom; k + kOversampling < n / 2; k *= 2) {
    Eigen::MatrixXd Y(n, k + kOversampling);
    Y.leftCols(Q.cols()) = Q;
    Y.rightCols(Y.cols() - Q.cols()) =
        Eigen::MatrixXd::NullaryExpr(n, Y.cols() - Q.cols(), [&] { return random.normal(); });
    for (int iteration = 0; iteration <= kMostPowerIterations; ++iteration) {
      const Eigen::HouseholderQR<Eigen::MatrixXd> qr(Y);
      Q = qr.householderQ() * Eigen::MatrixXd::Identity(n, Y.cols());
      Y = G(Q);
      pairs = all_eigenpairs(Q.transpose() * Y);
      Eigen::Index used = 0;
      for (double sum = 0; used < k && sum < wanted && pairs.values[used] > kNoise * pairs.values[0];)
        sum += pairs.values[used++];
      const Eigen::MatrixXd V = pairs.vectors.leftCols(used);
      pairs.residual =
          used == 0
              ? 0
              : (Y * V - Q * (V * pairs.values.head(used).asDiagonal())).colwise().norm().maxCoeff() / pairs.values[0];
      pairs.iterations = iteration;
      if (iteration >= power_iterations && pairs.residual <= kResidual) break;
    }
    const bool low_rank = pairs.values[k - 1] <= kNoise * pairs.values[0];
    if (pairs.values.head(k).sum() >= wanted || low_rank || k == max_pairs) {
      pairs.vectors = Q * pairs.vectors.leftCols(k);
      pairs.values.conservativeResize(k);
      return pairs;
    }
  }
  return {};
}

}  // namespace facewright
