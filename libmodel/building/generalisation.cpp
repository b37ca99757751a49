// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>
#include <atomic>
#include <memory>
#include <numeric>
#include <string>

#include "libmodel/building/metric_distances.h"
#include "libmodel/building/metrics.h"
#include "libmodel/building/pca.h"
#include "libmodel/building/procrustes.h"
#include "libmodel/building/sample_modes.h"
#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

constexpr Eigen::Index kTile =
    1024;  // vertices per block of reconstructions, so that all modes of one stay in the cache

struct Fold {
  std::vector<int> training, left_out;
};

std::vector<Fold> make_folds(int n, int folds) {
  const int count = folds == 0 ? n : std::min(folds, n);
  std::vector<Fold> list(static_cast<size_t>(count));
  for (int i = 0; i < n; ++i)
    for (int f = 0; f < count; ++f) {
      Fold& fold = list[static_cast<size_t>(f)];
      (i % count == f ? fold.left_out : fold.training).push_back(i);
    }
  return list;
}

// What is measured: items x modes each.
struct Tables {
  Eigen::MatrixXd vertices, landmarks, surface;
  void resize(Eigen::Index items, Eigen::Index modes) {
    vertices = landmarks = surface = Eigen::MatrixXd::Zero(items, modes);
  }
};

// The model of one fold: rows of X, of which `training` were used.
struct FoldModel {
  const SampleMatrix& X;
  std::vector<int> rows;
  Eigen::RowVectorXd mean;
  SampleModes modes;
};

// (n x modes): reconstruction with modes[m] modes = mean + sum_j (m-th column)_j (x_j - mean).
Eigen::MatrixXd combinations(const FoldModel& model, const Eigen::RowVectorXd& x, const std::vector<int>& modes) {
  const auto n = static_cast<Eigen::Index>(model.rows.size());
  Eigen::VectorXd b(n);  // inner products with the training samples
  const Eigen::RowVectorXd centred = x - model.mean;
  for (Eigen::Index j = 0; j < n; ++j) b[j] = centred.dot(model.X.row(model.rows[static_cast<size_t>(j)]) - model.mean);
  const Eigen::VectorXd c = model.modes.weights.transpose() * b;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, static_cast<Eigen::Index>(modes.size()));
  for (size_t m = 0; m < modes.size(); ++m) {
    const Eigen::Index k = std::min<Eigen::Index>(modes[m], c.size());
    A.col(static_cast<Eigen::Index>(m)).noalias() = model.modes.weights.leftCols(k) * c.head(k);
  }
  return A;
}

// Rows: reconstructions with each number of modes, at the vertices [first, first + count).
SampleMatrix reconstruct(const FoldModel& model, const Eigen::MatrixXd& A, Eigen::Index first, Eigen::Index count) {
  const Eigen::RowVectorXd mean = model.mean.segment(3 * first, 3 * count);
  SampleMatrix block(A.rows(), 3 * count);
  for (Eigen::Index j = 0; j < A.rows(); ++j)
    block.row(j) = model.X.row(model.rows[static_cast<size_t>(j)]).segment(3 * first, 3 * count) - mean;
  SampleMatrix R(A.cols(), 3 * count);
  R.noalias() = A.transpose() * block;
  R.rowwise() += mean;
  return R;
}

class Evaluator {
 public:
  Evaluator(const MetricsInput& input, const MetricsOptions& options, const std::vector<int>& modes)
      : input_(input), options_(options), modes_(modes), probe_(surface_probe(input, options)) {
    const Eigen::Index n = input.samples.rows(), count = static_cast<Eigen::Index>(modes.size());
    own.resize(n, count);
    target.resize(n, count);
    const Eigen::Index vertices = input.samples.cols() / 3;
    if (has_targets()) errors_target.setZero(n, vertices);
    errors_own.setZero(n, vertices);
    kept.resize(std::min<Eigen::Index>(options.keep, n), input.samples.cols());
    probe_of_.assign(static_cast<size_t>(vertices), -1);
    for (size_t p = 0; p < probe_.vertices.size(); ++p) probe_of_[static_cast<size_t>(probe_.vertices[p])] = int(p);
  }
  bool has_targets() const { return input_.targets.size() > 0; }
  bool has_surface() const { return !probe_.empty(); }

  void leave_out(int i, const FoldModel& model) {
    const Eigen::Index N = input_.samples.cols() / 3;
    Similarity motion;
    Vertices x = Eigen::Map<const Vertices>(input_.samples.row(i).data(), N, 3), y;
    if (options_.alignment != FoldAlignment::none) {
      const Eigen::Map<const Vertices> mean(model.mean.data(), N, 3);
      motion = fit_similarity(x, mean, input_.alignment_weights, options_.scaling);
      x = motion.apply(x);
    }
    if (has_targets()) y = motion.apply(Eigen::Map<const Vertices>(input_.targets.row(i).data(), N, 3));
    const Eigen::MatrixXd A = combinations(model, Eigen::Map<const Eigen::RowVectorXd>(x.data(), x.size()), modes_);
    const Eigen::VectorXd weights = sample_weights(input_, i);
    SampleMatrix probe(static_cast<Eigen::Index>(modes_.size()), static_cast<Eigen::Index>(3 * probe_.vertices.size()));
    for (Eigen::Index first = 0; first < N; first += kTile) {
      const Eigen::Index count = std::min(kTile, N - first);
      const SampleMatrix R = reconstruct(model, A, first, count);
      add_distances(R, x, weights, first, i, own, errors_own);
      if (has_targets()) add_distances(R, y, weights, first, i, target, errors_target);
      for (Eigen::Index v = 0; v < count; ++v)
        if (const int p = probe_of_[static_cast<size_t>(first + v)]; p >= 0)
          probe.middleCols(3 * p, 3) = R.middleCols(3 * v, 3);
      if (i < kept.rows()) kept.row(i).segment(3 * first, 3 * count) = R.bottomRows(1);
    }
    add_landmarks(model, A, x, i, own);
    if (has_targets()) add_landmarks(model, A, y, i, target);
    if (has_surface()) {
      measure_surface(probe, x, i, own);
      if (has_targets()) measure_surface(probe, y, i, target);
    }
    if (i < kept.rows()) {
      Eigen::Map<Vertices> k(kept.row(i).data(), N, 3);
      k = motion.inverse().apply(k);
    }
  }

  Tables own, target;
  SampleMatrix errors_own, errors_target;  // scans x N, with the most modes
  SampleMatrix kept;

 private:
  // Weighted mean of the distances to x of the reconstructions R from vertex `first` on.
  static void add_distances(const SampleMatrix& R, const Vertices& x, const Eigen::VectorXd& weights,
                            Eigen::Index first, int i, Tables& tables, SampleMatrix& errors) {
    const Eigen::Index count = R.cols() / 3;
    for (Eigen::Index m = 0; m < R.rows(); ++m) {
      const Eigen::Map<const Vertices> r(R.row(m).data(), count, 3);
      const Eigen::VectorXd d = (r - x.middleRows(first, count)).rowwise().norm();
      tables.vertices(i, m) += weights.segment(first, count).dot(d);
      if (m + 1 == R.rows()) errors.row(i).segment(first, count) = d.transpose();
    }
  }

  void add_landmarks(const FoldModel& model, const Eigen::MatrixXd& A, const Vertices& x, int i, Tables& tables) const {
    for (const int v : input_.landmarks) {
      const SampleMatrix R = reconstruct(model, A, v, 1);
      tables.landmarks.row(i) += (R.rowwise() - x.row(v)).rowwise().norm().transpose();
    }
    if (!input_.landmarks.empty()) tables.landmarks.row(i) /= static_cast<double>(input_.landmarks.size());
  }

  void measure_surface(const SampleMatrix& probe, const Vertices& x, int i, Tables& tables) const {
    const SurfaceIndex surface(x, input_.F);
    for (Eigen::Index m = 0; m < probe.rows(); ++m)
      tables.surface(i, m) =
          surface_distance(surface, probe_, Eigen::Map<const Vertices>(probe.row(m).data(), probe.cols() / 3, 3));
  }

  const MetricsInput& input_;
  const MetricsOptions& options_;
  const std::vector<int>& modes_;
  SurfaceProbe probe_;
  std::vector<int> probe_of_;  // place of a vertex in the probe, -1: none
};

DistanceCurves curves(const std::vector<int>& modes, Tables& tables, bool landmarks, bool surface) {
  DistanceCurves c;
  c.vertices = curve_of(modes, std::move(tables.vertices));
  if (landmarks) c.landmarks = curve_of(modes, std::move(tables.landmarks));
  if (surface) c.surface = curve_of(modes, std::move(tables.surface));
  return c;
}

// Procrustes of the training samples alone, starting where all were aligned together.
SampleMatrix align_training(const MetricsInput& input, const Fold& fold, const MetricsOptions& options) {
  SampleMatrix training = input.samples(fold.training, Eigen::all);
  return generalised_procrustes(std::move(training), input.alignment_weights, input.reference,
                                {.scaling = options.scaling, .threads = 1})
      .shapes;
}

}  // namespace

GeneralisationResult generalisation(const MetricsInput& input, const MetricsOptions& options,
                                    const Progress& progress) {
  check_metrics(input, options);
  const int n = static_cast<int>(input.samples.rows());
  GeneralisationResult result;
  if (n < 2) return result;
  const std::vector<Fold> folds = make_folds(n, options.folds);
  result.fold_count = static_cast<int>(folds.size());
  result.fewest_training = n;
  for (const Fold& fold : folds) result.fewest_training = std::min(result.fewest_training, int(fold.training.size()));
  const std::vector<int> modes = mode_counts(options.modes, result.fewest_training - 1);
  if (modes.empty()) return result;

  std::vector<int> all(static_cast<size_t>(n));
  std::iota(all.begin(), all.end(), 0);
  const Eigen::RowVectorXd centre = mean_of_rows(input.samples, all);
  const bool anew = options.alignment == FoldAlignment::per_fold;
  const Eigen::MatrixXd G = anew ? Eigen::MatrixXd() : gram_matrix(input.samples, centre, options.threads);
  Evaluator evaluator(input, options, modes);
  std::atomic<int> done = 0;
  parallel_for(result.fold_count, options.threads, [&](int f) {
    const Fold& fold = folds[static_cast<size_t>(f)];
    SampleMatrix training;
    FoldModel model{anew ? training : input.samples, fold.training, {}, {}};
    if (anew) {
      training = align_training(input, fold, options);
      std::iota(model.rows.begin(), model.rows.end(), 0);
    }
    model.mean = mean_of_rows(model.X, model.rows);
    model.modes =
        sample_modes(anew ? gram_matrix(training, model.mean, 1) : G, model.rows, rounding_variance(model.mean));
    for (const int i : fold.left_out) evaluator.leave_out(i, model);
    if (progress) progress({"generalisation", ++done, result.fold_count, ""});
  });
  const bool landmarks = !input.landmarks.empty();
  result.own = curves(modes, evaluator.own, landmarks, evaluator.has_surface());
  result.errors.resize(input.samples.cols() / 3, evaluator.has_targets() ? 2 : 1);
  result.errors.col(0) = evaluator.errors_own.colwise().mean().transpose();
  if (evaluator.has_targets()) {
    result.target = curves(modes, evaluator.target, landmarks, evaluator.has_surface());
    result.errors.col(1) = evaluator.errors_target.colwise().mean().transpose();
  }
  result.kept = std::move(evaluator.kept);
  return result;
}

}  // namespace facewright
