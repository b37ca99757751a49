// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/incomplete_pca.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "libmodel/building/pca.h"
#include "libmodel/building/residual_field.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

constexpr int kBlock = 256;  // vertices; sums run over blocks in their order, whatever the threads

constexpr double kLeastSpread = 1e-4;  // of a variance: neighbours never agree better than this

int block_count(Eigen::Index vertices) { return static_cast<int>((vertices + kBlock - 1) / kBlock); }

// Sum of body(first, last) over blocks of vertices.
template <typename T, typename Body>
T sum_over_blocks(Eigen::Index vertices, int threads, const T& zero, const Body& body) {
  std::vector<T> parts(static_cast<size_t>(block_count(vertices)), zero);
  parallel_for(static_cast<int>(parts.size()), threads, [&](int b) {
    const Eigen::Index first = Eigen::Index(b) * kBlock;
    parts[static_cast<size_t>(b)] = body(first, std::min<Eigen::Index>(first + kBlock, vertices));
  });
  T sum = zero;
  for (const T& part : parts) sum += part;
  return sum;
}

// What is expected of a vertex's rows before its values are looked at.
struct RowPrior {
  Eigen::VectorXd ridge;  // (K + 1) noise over the variance of an entry; the mean's comes last
  Eigen::MatrixXd rows;   // (N x 3 (K + 1)) expectations, channel by channel; empty: zero
};

// Scores of all samples with a constant 1 behind them, and their expected outer products.
struct Scores {
  Eigen::MatrixXd mean;                     // (S x K + 1)
  std::vector<Eigen::MatrixXd> second;      // (S) of (K + 1 x K + 1)
  Eigen::MatrixXd total_second;             // their sum
  std::vector<Eigen::MatrixXd> covariance;  // (S) of (K x K)
};

class Fit {
 public:
  Fit(const SampleMatrix& X, const SampleMatrix& weights, const IncompletePcaOptions& options)
      : X_(X), W_(weights), options_(options), S_(X.rows()), N_(weights.cols()) {}

  IncompletePca run() {
    start();
    model_.converged = model_.mode_count() == 0;
    while (!model_.converged && model_.iterations < options_.max_iterations) {
      ++model_.iterations;
      const double deviation = std::sqrt(model_.noise);
      const Scores scores = expect();
      maximise(scores);
      model_.last_change = fill(scores);
      model_.converged =
          model_.last_change < options_.tolerance && std::abs(std::sqrt(model_.noise) - deviation) < options_.tolerance;
    }
    return std::move(model_);
  }

 private:
  // Weighted means, then the PCA of samples whose gaps hold the mean moved by how the sample differs where it was seen.
  void start() {
    seen_ = W_.colwise().sum();
    weight_ = 3 * seen_.sum();
    model_.mean.resize(3 * N_);
    for (Eigen::Index v = 0; v < N_; ++v)
      for (int c = 0; c < 3; ++c)
        model_.mean[3 * v + c] = seen_[v] > 0 ? weighted_mean(3 * v + c) : X_.col(3 * v + c).mean();
    filled_ = X_;
    parallel_for(static_cast<int>(S_), options_.threads, [&](int s) { shift(s); });
    const Eigen::Index modes = std::min<Eigen::Index>(options_.modes, S_ - 1);
    model_.noise = spread();
    model_.factors.resize(3 * N_, 0);
    find_supported(modes);
    if (modes < 1 || weight_ <= 0) return;
    PcaOptions pca;
    pca.variance_share = 1;
    pca.max_modes = static_cast<int>(modes);
    pca.threads = options_.threads;
    const PcaResult fit = fit_pca(filled_, pca);
    least_noise_ = std::max(1e-12 * fit.summary.total_variance / static_cast<double>(3 * N_), 1e-300);
    const double rest = fit.summary.total_variance - fit.summary.kept_variance;
    model_.noise = std::max(rest / static_cast<double>(3 * N_), least_noise_);
    model_.factors = fit.model.rescaled_basis();
    for (Eigen::Index v = 0; v < N_; ++v)
      if (seen_[v] <= 0) model_.factors.middleRows<3>(3 * v).setZero();
  }

  // Those whose own values can tell their rows: half as often seen as the best, or enough for a regression.
  void find_supported(Eigen::Index modes) {
    const double enough = N_ > 0 ? std::min(0.5 * seen_.maxCoeff(), 3.0 * static_cast<double>(modes + 1)) : 0;
    supported_.assign(static_cast<size_t>(N_), true);
    if (options_.surface == nullptr) return;
    for (Eigen::Index v = 0; v < N_; ++v) supported_[static_cast<size_t>(v)] = seen_[v] >= enough;
    has_unsupported_ = std::find(supported_.begin(), supported_.end(), false) != supported_.end();
  }

  double weighted_mean(Eigen::Index column) const {
    double sum = 0;
    for (Eigen::Index s = 0; s < S_; ++s)
      if (W_(s, column / 3) > 0) sum += W_(s, column / 3) * X_(s, column);
    return sum / seen_[column / 3];
  }

  void shift(int s) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (Eigen::Index v = 0; v < N_; ++v)
      if (W_(s, v) > 0) sum += W_(s, v) * (X_.row(s).segment<3>(3 * v).transpose() - model_.mean.segment<3>(3 * v));
    const double total = W_.row(s).sum();
    if (total > 0) sum /= total;
    for (Eigen::Index v = 0; v < N_; ++v)
      if (!(W_(s, v) > 0))
        filled_.row(s).segment<3>(3 * v) = (model_.mean.segment<3>(3 * v) + (seen_[v] > 0 ? sum : sum * 0)).transpose();
  }

  // Weighted mean square about the mean.
  double spread() const {
    if (weight_ <= 0) return 0;
    return sum_over_blocks(
               N_, options_.threads, 0.0,
               [&](Eigen::Index first, Eigen::Index last) {
                 double sum = 0;
                 for (Eigen::Index s = 0; s < S_; ++s)
                   for (Eigen::Index v = first; v < last; ++v)
                     if (W_(s, v) > 0)
                       sum += W_(s, v) *
                              (X_.row(s).segment<3>(3 * v).transpose() - model_.mean.segment<3>(3 * v)).squaredNorm();
                 return sum;
               }) /
           weight_;
  }

  Scores expect() const {
    const Eigen::Index K = model_.mode_count();
    Scores scores{Eigen::MatrixXd(S_, K + 1), std::vector<Eigen::MatrixXd>(static_cast<size_t>(S_)),
                  Eigen::MatrixXd::Zero(K + 1, K + 1), std::vector<Eigen::MatrixXd>(static_cast<size_t>(S_))};
    const ScoreEstimator estimate(model_, options_.threads);
    parallel_for(static_cast<int>(S_), options_.threads, [&](int s) {
      ScorePosterior posterior = estimate(filled_.row(s), W_.row(s));
      scores.mean.row(s) << posterior.mean.transpose(), 1;
      Eigen::MatrixXd& second = scores.second[static_cast<size_t>(s)];
      second = scores.mean.row(s).transpose() * scores.mean.row(s);
      second.topLeftCorner(K, K) += posterior.covariance;
      scores.covariance[static_cast<size_t>(s)] = std::move(posterior.covariance);
    });
    for (const Eigen::MatrixXd& second : scores.second) scores.total_second += second;
    return scores;
  }

  void maximise(const Scores& scores) {
    const RowPrior plain = variance_prior(), near = neighbour_prior(plain);
    const double sum = sum_over_blocks(N_, options_.threads, 0.0, [&](Eigen::Index first, Eigen::Index last) {
      double part = 0;
      for (Eigen::Index v = first; v < last; ++v)
        if (seen_[v] > 0) part += regress(v, scores, supported_[static_cast<size_t>(v)] ? plain : near);
      return part;
    });
    model_.noise = std::max(sum / weight_, least_noise_);
  }

  // Zero mean and the variance the factors of a mode have; nothing about the mean.
  RowPrior variance_prior() const {
    const Eigen::Index K = model_.mode_count();
    RowPrior prior{Eigen::VectorXd::Zero(K + 1), {}};
    const auto seen_rows = static_cast<double>(3 * (seen_.array() > 0).count());
    for (Eigen::Index k = 0; k < K; ++k)
      prior.ridge[k] = model_.noise / std::max(model_.factors.col(k).squaredNorm() / seen_rows, 1e-300);
    return prior;
  }

  // Harmonic between the well seen, with the variance that one of those has about its neighbours.
  RowPrior neighbour_prior(const RowPrior& plain) const {
    if (!has_unsupported_) return plain;
    const Eigen::Index K = model_.mode_count();
    RowPrior prior{Eigen::VectorXd(K + 1), Eigen::MatrixXd(N_, 3 * (K + 1))};
    for (Eigen::Index v = 0; v < N_; ++v)
      for (int c = 0; c < 3; ++c)
        prior.rows.row(v).segment((K + 1) * c, K + 1) << model_.factors.row(3 * v + c), model_.mean[3 * v + c];
    const Eigen::RowVectorXd squares = options_.surface->spread_about_neighbours(prior.rows, supported_);
    double total = model_.noise;
    for (Eigen::Index k = 0; k < K; ++k) total += model_.noise / plain.ridge[k];
    for (Eigen::Index k = 0; k <= K; ++k) {
      const double own = k < K ? model_.noise / plain.ridge[k] : total;
      const double variance = (squares[k] + squares[K + 1 + k] + squares[2 * (K + 1) + k]) / 3;
      prior.ridge[k] = model_.noise / std::max(variance, kLeastSpread * own);
    }
    options_.surface->fill_harmonically(prior.rows, supported_);
    return prior;
  }

  // New rows of vertex v; returns its weighted expected square residual.
  double regress(Eigen::Index v, const Scores& scores, const RowPrior& prior) {
    const Eigen::Index K = model_.mode_count();
    Eigen::MatrixXd A = scores.total_second;
    Eigen::MatrixXd b = Eigen::MatrixXd::Zero(K + 1, 3);
    for (Eigen::Index s = 0; s < S_; ++s) {
      const double w = W_(s, v);
      if (w < 1) A -= (1 - w) * scores.second[static_cast<size_t>(s)];
      if (w > 0) b += w * scores.mean.row(s).transpose() * filled_.row(s).segment<3>(3 * v);
    }
    const Eigen::MatrixXd second = A;
    Eigen::MatrixXd pulled = b;
    A.diagonal() += prior.ridge;
    A.diagonal().array() += 1e-12 * A.diagonal().maxCoeff();
    if (prior.rows.size() > 0) pulled += prior.ridge.asDiagonal() * prior.rows.row(v).reshaped(K + 1, 3);
    const Eigen::MatrixXd rows = A.ldlt().solve(pulled);  // (K + 1 x 3)
    model_.factors.middleRows<3>(3 * v) = rows.topRows(K).transpose();
    model_.mean.segment<3>(3 * v) = rows.row(K).transpose();
    double squares = 0;
    for (Eigen::Index s = 0; s < S_; ++s)
      if (W_(s, v) > 0) squares += W_(s, v) * filled_.row(s).segment<3>(3 * v).squaredNorm();
    return std::max(0.0, squares - 2 * (rows.array() * b.array()).sum() + (rows.transpose() * second * rows).trace());
  }

  // Predictions into the values nobody knows; returns how much they changed.
  double fill(const Scores& scores) {
    const Eigen::Index K = model_.mode_count();
    Eigen::VectorXd change = Eigen::VectorXd::Zero(S_), count = change;
    parallel_for(static_cast<int>(S_), options_.threads, [&](int s) {
      for (Eigen::Index v = 0; v < N_; ++v) {
        if (W_(s, v) > 0 || seen_[v] <= 0) continue;
        auto x = filled_.row(s).segment<3>(3 * v);
        const Eigen::Vector3d now = model_.mean.segment<3>(3 * v) +
                                    model_.factors.middleRows<3>(3 * v) * scores.mean.row(s).head(K).transpose();
        change[s] += (now.transpose() - x).squaredNorm();
        count[s] += 3;
        x = now.transpose();
      }
    });
    return std::sqrt(change.sum() / std::max(1.0, count.sum()));
  }

  const SampleMatrix &X_, &W_;
  const IncompletePcaOptions& options_;
  const Eigen::Index S_, N_;
  IncompletePca model_;
  SampleMatrix filled_;  // X with predictions where the weight is 0
  Eigen::RowVectorXd seen_;
  std::vector<bool> supported_;
  bool has_unsupported_ = false;
  double weight_ = 0, least_noise_ = 1e-300;
};

}  // namespace

ScoreEstimator::ScoreEstimator(const IncompletePca& model, int threads) : model_(model) {
  const Eigen::Index K = model.mode_count();
  information_ = sum_over_blocks(model.mean.size() / 3, threads, Eigen::MatrixXd(Eigen::MatrixXd::Zero(K, K)),
                                 [&](Eigen::Index first, Eigen::Index last) -> Eigen::MatrixXd {
                                   const auto B = model.factors.middleRows(3 * first, 3 * (last - first));
                                   return B.transpose() * B;
                                 });
}

ScorePosterior ScoreEstimator::operator()(const Eigen::Ref<const Eigen::RowVectorXd>& row,
                                          const Eigen::Ref<const Eigen::RowVectorXd>& weights) const {
  const Eigen::Index K = model_.mode_count();
  const double noise = std::max(model_.noise, 1e-300);
  Eigen::MatrixXd A = information_;
  Eigen::VectorXd residual(row.size());
  for (Eigen::Index v = 0; v < weights.size(); ++v) {
    const double w = weights[v];
    if (w < 1) {
      const auto B = model_.factors.middleRows<3>(3 * v);
      A.noalias() -= (1 - w) * (B.transpose() * B);
    }
    if (w > 0)
      residual.segment<3>(3 * v) = w * (row.segment<3>(3 * v).transpose() - model_.mean.segment<3>(3 * v));
    else
      residual.segment<3>(3 * v).setZero();
  }
  A /= noise;
  A.diagonal().array() += 1;
  const Eigen::LDLT<Eigen::MatrixXd> solver(A);
  ScorePosterior posterior;
  posterior.mean = solver.solve(Eigen::VectorXd(model_.factors.transpose() * residual / noise));
  posterior.covariance = solver.solve(Eigen::MatrixXd::Identity(K, K));
  return posterior;
}

IncompletePca fit_incomplete_pca(const SampleMatrix& X, const SampleMatrix& weights,
                                 const IncompletePcaOptions& options) {
  return Fit(X, weights, options).run();
}

}  // namespace facewright
