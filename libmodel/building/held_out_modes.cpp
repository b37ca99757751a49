// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/held_out_modes.h"

#include <algorithm>
#include <cmath>

#include "libmodel/building/incomplete_pca.h"
#include "libmodel/core/parallel.h"
#include "libmodel/core/random.h"

namespace facewright {
namespace {

constexpr Eigen::Index kVertices = 3000, kSamples = 200;
constexpr double kHidden = 0.1;                      // share
constexpr double kSmallest = 0.04, kLargest = 0.11;  // radius of a patch over the face's extent: 8 to 22 mm

// Every k-th, at most `most`.
std::vector<int> thinned(Eigen::Index n, Eigen::Index most) {
  const Eigen::Index step = std::max<Eigen::Index>(1, (n + most - 1) / most);
  std::vector<int> list;
  for (Eigen::Index i = 0; i < n; i += step) list.push_back(static_cast<int>(i));
  return list;
}

struct Subset {
  SampleMatrix values, weights, hidden;  // hidden: weights of the hidden, 0 elsewhere
};

void hide(Subset* set, const Vertices& P, std::uint64_t seed) {
  const auto N = static_cast<int>(set->weights.cols());
  const double extent = P.rows() > 0 ? (P.colwise().maxCoeff() - P.colwise().minCoeff()).maxCoeff() : 0;
  set->hidden = SampleMatrix::Zero(set->weights.rows(), N);
  for (Eigen::Index s = 0; s < set->weights.rows(); ++s) {
    Random random = Random::stream(seed, static_cast<std::uint64_t>(s));
    const double goal = kHidden * set->weights.row(s).sum();
    double sum = 0;
    const auto take = [&](int v) {
      sum += set->weights(s, v);
      set->hidden(s, v) += set->weights(s, v);
      set->weights(s, v) = 0;
    };
    for (int tries = 0; sum < goal && tries < 10 * N; ++tries) {
      const int centre = random.index(N);
      if (extent <= 0) {
        take(centre);
        continue;
      }
      const double radius = random.uniform(kSmallest, kLargest) * extent;
      for (int v = 0; v < N; ++v)
        if ((P.row(v) - P.row(centre)).squaredNorm() < radius * radius) take(v);
    }
  }
}

double error(const Subset& set, const IncompletePca& model, int threads) {
  const ScoreEstimator estimate(model, threads);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(set.values.rows());
  parallel_for(static_cast<int>(set.values.rows()), threads, [&](int s) {
    const Eigen::VectorXd x = model.mean + model.factors * estimate(set.values.row(s), set.weights.row(s)).mean;
    for (Eigen::Index v = 0; v < set.hidden.cols(); ++v)
      if (set.hidden(s, v) > 0)
        squares[s] +=
            set.hidden(s, v) * (set.values.row(s).segment<3>(3 * v).transpose() - x.segment<3>(3 * v)).squaredNorm();
  });
  return std::sqrt(squares.sum() / std::max(3 * set.hidden.sum(), 1e-300));
}

Subset subset_of(const SampleMatrix& values, const SampleMatrix& weights, const std::vector<int>& vertices) {
  const std::vector<int> samples = thinned(values.rows(), kSamples);
  std::vector<int> columns;
  for (const int v : vertices)
    for (int c = 0; c < 3; ++c) columns.push_back(3 * v + c);
  return {values(samples, columns), weights(samples, vertices), {}};
}

}  // namespace

HeldOutModes choose_modes_by_hiding(const SampleMatrix& values, const SampleMatrix& weights, const Vertices& V,
                                    const FillUnseenOptions& options) {
  const std::vector<int> vertices = thinned(weights.cols(), kVertices);
  Subset set = subset_of(values, weights, vertices);
  hide(&set, V.rows() > 0 ? Vertices(V(vertices, Eigen::all)) : Vertices(), options.seed);
  IncompletePcaOptions fit{0, options.max_iterations, options.tolerance, options.threads};
  HeldOutModes best;
  best.error.mean = best.error.filled = error(set, fit_incomplete_pca(set.values, set.weights, fit), options.threads);
  const int most = std::min(options.most_modes, static_cast<int>(set.values.rows()) / 3);
  int worse = 0;
  for (int k = 1; k <= most && worse < 2; k = k < 4 ? k + 1 : k + k / 2) {
    fit.modes = k;
    const double e = error(set, fit_incomplete_pca(set.values, set.weights, fit), options.threads);
    worse = e < best.error.filled ? 0 : worse + 1;
    if (worse > 0) continue;
    best.modes = k;
    best.error.filled = e;
  }
  return best;
}

}  // namespace facewright
