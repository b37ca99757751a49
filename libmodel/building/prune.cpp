// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/prune.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "libmodel/building/gram.h"
#include "libmodel/building/principal_modes.h"
#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

constexpr int kSamplesPerMode = 10;
constexpr int kFew = 400;    // samples up to which all eigenpairs are found: see fit_pca
constexpr int kMany = 2000;  // samples from which the folds share the threads one after the other, to save memory

// Regularised lower incomplete gamma function: by its series below a + 1, by Lentz's continued fraction above.
double incomplete_gamma(double a, double x) {
  if (x <= 0) return 0;
  const double scale = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1) {
    double term = 1 / a, sum = term;
    for (double k = a + 1; term > 1e-17 * sum; ++k) sum += term *= x / k;
    return sum * scale;
  }
  double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (int i = 1; i < 10000; ++i) {
    const double numerator = -i * (i - a);
    b += 2;
    d = 1 / (numerator * d + b);
    c = b + numerator / c;
    h *= d * c;
    if (std::abs(d * c - 1) < 1e-16) break;
  }
  return 1 - scale * h;
}

void check(const PruneOptions& options) {
  if (!(options.quantile > 0 && options.quantile < 1) || options.modes < 1)
    throw InvalidInput("prune: expected 0 < quantile < 1 and at least one mode; got " +
                       std::to_string(options.quantile) + " and " + std::to_string(options.modes));
}

// A model of the samples `training`, seen through inner products: squared errors of `sample` after 0, 1, .. modes.
struct GramModel {
  GramModel(const Eigen::MatrixXd& G, std::vector<int> samples, int modes, int threads) : training(std::move(samples)) {
    Eigen::MatrixXd part = gram_of(G, training);
    means = part.colwise().mean().transpose();
    mean = means.mean();
    const double rounding = 1e-15 * part.diagonal().maxCoeff();
    part = centred_gram(std::move(part));
    pairs =
        part.rows() > kFew && modes > 0 ? lanczos_eigenpairs(part, part.trace(), modes, threads) : all_eigenpairs(part);
    const double floor = 1e-12 * pairs.values[0] + rounding;
    rank = std::min<Eigen::Index>(part.rows() - 1, (pairs.values.array() > floor).count());
  }
  Eigen::RowVectorXd squared_errors(const Eigen::MatrixXd& G, int sample, Eigen::Index modes) const {
    const Eigen::VectorXd products = G(training, sample);
    const double product_mean = products.mean();
    const Eigen::VectorXd centred = (products - means).array() - (product_mean - mean);
    Eigen::RowVectorXd errors(modes + 1);
    errors[0] = G(sample, sample) - 2 * product_mean + mean;
    for (Eigen::Index m = 0; m < modes; ++m) {
      const double along = pairs.vectors.col(m).dot(centred);
      errors[m + 1] = std::max(0.0, errors[m] - along * along / pairs.values[m]);
    }
    return errors;
  }

  std::vector<int> training;
  Eigen::VectorXd means;
  double mean = 0;
  EigenPairs pairs;
  Eigen::Index rank = 0;
};

}  // namespace

double chi_squared_quantile(double p, double degrees) {
  if (!(p > 0 && p < 1) || !(degrees > 0)) throw InvalidInput("chi-squared: expected 0 < p < 1 and degrees > 0");
  double lo = 0, hi = degrees + 10;
  while (incomplete_gamma(degrees / 2, hi / 2) < p) hi *= 2;
  while (hi - lo > 1e-13 * hi) {
    const double middle = (lo + hi) / 2;
    (incomplete_gamma(degrees / 2, middle / 2) < p ? lo : hi) = middle;
  }
  return (lo + hi) / 2;
}

PruneResult find_outliers(const Eigen::MatrixXd& scores, const PruneOptions& options) {
  check(options);
  PruneResult result;
  result.options = options;
  const Eigen::Index n = scores.rows();
  result.modes =
      static_cast<int>(std::min({scores.cols(), static_cast<Eigen::Index>(options.modes), n / kSamplesPerMode}));
  result.squared_mahalanobis = scores.leftCols(result.modes).rowwise().squaredNorm();
  result.threshold = result.modes == 0 ? std::numeric_limits<double>::infinity()
                                       : chi_squared_quantile(options.quantile, result.modes);
  for (int i = 0; i < n; ++i) {
    if (result.squared_mahalanobis[i] <= result.threshold) {
      result.kept.push_back(i);
      continue;
    }
    PrunedSample sample{i, result.squared_mahalanobis[i]};
    scores.row(i).head(result.modes).cwiseAbs().maxCoeff(&sample.mode);
    sample.score = scores(i, sample.mode);
    result.removed.push_back(sample);
  }
  std::ranges::stable_sort(result.removed, std::ranges::greater{}, &PrunedSample::squared_mahalanobis);
  return result;
}

PruneResult find_outliers_by_gram(const Eigen::MatrixXd& G, const PruneOptions& options, int threads) {
  check(options);
  const Eigen::Index n = G.rows();
  if (n < 2) return find_outliers(Eigen::MatrixXd(n, 0), options);
  PcaOptions pca;
  pca.variance_share = 1;
  pca.max_modes = options.modes;
  pca.threads = threads;
  Eigen::MatrixXd covariance = centred_gram(G);
  covariance /= static_cast<double>(n - 1);
  PcaResult modes = pca_without_modes(Eigen::RowVectorXd::Zero(1), n, pca);
  choose_modes(gram_eigenpairs(covariance, pca, &modes.summary), covariance.trace(), &modes);
  return find_outliers(modes.scores, options);
}

Eigen::MatrixXd held_out_squared_errors(const Eigen::MatrixXd& G, const HeldOutOptions& options) {
  const int n = static_cast<int>(G.rows()), folds = options.folds == 0 ? n : options.folds;
  if (n < 2 || folds < 2 || folds > n || options.max_modes < 0)
    throw InvalidInput("held-out errors: expected at least 2 samples, 2 to as many folds, and modes >= 0; got " +
                       std::to_string(n) + ", " + std::to_string(folds) + " and " + std::to_string(options.max_modes));
  Eigen::MatrixXd errors(n, options.max_modes + 1);
  Eigen::VectorXi ranks(folds);
  parallel_for(folds, n < kMany ? options.threads : 1, [&](int fold) {
    std::vector<int> training;
    for (int i = 0; i < n; ++i)
      if (i % folds != fold) training.push_back(i);
    const GramModel model(G, std::move(training), options.max_modes, n < kMany ? 1 : options.threads);
    ranks[fold] = static_cast<int>(model.rank);
    const Eigen::Index modes = std::min<Eigen::Index>(model.rank, options.max_modes);
    for (int i = fold; i < n; i += folds) errors.row(i).head(modes + 1) = model.squared_errors(G, i, modes);
  });
  return errors.leftCols(std::min(ranks.minCoeff(), options.max_modes) + 1);
}

}  // namespace facewright
