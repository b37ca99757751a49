// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/pca_out_of_core.h"

#include <algorithm>
#include <cmath>

#include "libmodel/building/column_blocks.h"
#include "libmodel/building/principal_modes.h"
#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

Vertices as_shape(const Eigen::RowVectorXd& row) { return Eigen::Map<const Vertices>(row.data(), row.size() / 3, 3); }
Eigen::RowVectorXd as_row(const Vertices& V) { return Eigen::Map<const Eigen::RowVectorXd>(V.data(), V.size()); }

void check_weights(const SampleStore& store, Eigen::Index vertices, const Eigen::VectorXd& weights) {
  if (3 * vertices != store.cols() || weights.size() != vertices)
    throw InvalidInput("sample store: " + std::to_string(vertices) + " vertices and " + std::to_string(weights.size()) +
                       " weights do not fit its " + std::to_string(store.cols()) + " columns");
  if (!weights.allFinite() || (weights.array() < 0).any())
    throw InvalidInput("sample store: weights must be finite and not negative");
}

}  // namespace

PcaResult fit_pca(SampleStore& store, const PcaOptions& options, const Progress& progress) {
  check_pca_options(options);
  const Eigen::Index n = store.sample_count();
  if (n == 0) throw InvalidInput("pca: there are no samples");
  PcaResult result = pca_without_modes(store.origin(), n, options);
  Eigen::MatrixXd W(n, 0);
  if (n > 1) {
    Eigen::MatrixXd G = centred_gram(store.gram(options.threads, progress));
    G /= static_cast<double>(n - 1);
    W = choose_modes(gram_eigenpairs(G, options, &result.summary), G.trace(), &result);
  }
  result.model.basis.resize(store.cols(), W.cols());
  parallel_for(column_block_count(store.cols()), options.threads, [&](int b) {
    const auto [col, cols] = column_block(store.cols(), b);
    SampleMatrix C = store.centred_block(0, n, col, cols);
    const Eigen::RowVectorXd mean = C.colwise().sum() / static_cast<double>(n);
    C.rowwise() -= mean;
    result.model.mean.segment(col, cols) += mean.transpose();
    result.model.basis.middleRows(col, cols).noalias() = C.transpose() * W;
  });
  finish_basis(&result, options.threads);
  return result;
}

Similarity append_aligned(SampleStore& store, const std::string& id, const Vertices& shape,
                          const Eigen::VectorXd& weights, Scaling scaling, int threads) {
  check_weights(store, shape.rows(), weights);
  if (!shape.allFinite()) throw InvalidInput("sample store: scan '" + id + "' holds NaN or infinity");
  const Similarity mean_from_scan = fit_similarity(shape, as_shape(store.mean(threads)), weights, scaling);
  store.append({id}, as_row(mean_from_scan.apply(shape)), {mean_from_scan});
  return mean_from_scan;
}

namespace {

// How much each vertex of a sample counts in its motion and in the mean (procrustes.h).
Eigen::VectorXd attention_of(const SampleVisibility& visibility, const std::string& id, Eigen::Index vertices,
                             double unseen_weight) {
  if (!visibility) return Eigen::VectorXd::Ones(vertices);
  const Eigen::VectorXd seen = visibility(id);
  if (seen.size() != vertices || !seen.allFinite() || seen.minCoeff() < 0 || seen.maxCoeff() > 1)
    throw InvalidInput("procrustes: visibility must be 0..1 for every vertex of scan '" + id + "'");
  return (unseen_weight + (1 - unseen_weight) * seen.array()).matrix();
}

// Sums over some of the samples.
struct AlignmentSums {
  Vertices attentive, plain;
  Eigen::VectorXd attention;
  double seen = 0;

  explicit AlignmentSums(Eigen::Index n)
      : attentive(Vertices::Zero(n, 3)), plain(Vertices::Zero(n, 3)), attention(Eigen::VectorXd::Zero(n)) {}
  AlignmentSums& operator+=(const AlignmentSums& other) {
    attentive += other.attentive, plain += other.plain, attention += other.attention, seen += other.seen;
    return *this;
  }
};

}  // namespace

ProcrustesSummary realign(SampleStore& store, const Eigen::VectorXd& weights, const Vertices& reference,
                          const ProcrustesOptions& options, const SampleVisibility& visibility,
                          const Progress& progress) {
  check_weights(store, reference.rows(), weights);
  if (!(options.unseen_weight > 0 && options.unseen_weight <= 1))
    throw InvalidInput("procrustes: expected 0 < unseen_weight <= 1");
  const int n = static_cast<int>(store.sample_count());
  if (n == 0) throw InvalidInput("procrustes: there are no scans");
  ProcrustesSummary summary;
  summary.options = options;
  std::vector<Similarity> steps(static_cast<size_t>(n));
  Eigen::VectorXd sizes(n);
  parallel_for(n, options.threads, [&](int i) { sizes[i] = centroid_size(as_shape(store.sample(i)), weights); });
  ProcrustesTarget target(reference, weights, options.scaling, sizes.mean());
  // Rows are summed in fixed parts, so that the bytes do not depend on threads.
  const int parts = std::min(16, n);
  Eigen::VectorXd squares(n);
  while (summary.iterations < options.max_iterations && !summary.converged) {
    ++summary.iterations;
    std::vector<AlignmentSums> sums(static_cast<size_t>(parts), AlignmentSums(reference.rows()));
    parallel_for(parts, options.threads, [&](int part) {
      AlignmentSums& sum = sums[static_cast<size_t>(part)];
      for (int i = n * part / parts; i < n * (part + 1) / parts; ++i) {
        const Vertices shape = as_shape(store.sample(i));
        const Eigen::VectorXd attention =
            attention_of(visibility, store.ids()[static_cast<size_t>(i)], reference.rows(), options.unseen_weight);
        Similarity& step = steps[static_cast<size_t>(i)];
        step = fit_similarity(shape, target.mean(), weights.cwiseProduct(attention), options.scaling);
        const Vertices moved = step.apply(shape);
        squares[i] = weights.dot((moved - target.mean()).rowwise().squaredNorm());
        sum.plain += moved;
        sum.attentive += attention.asDiagonal() * moved;
        sum.attention += attention;
        sum.seen += weights.dot(attention);
      }
    });
    for (int part = 1; part < parts; ++part) sums[0] += sums[static_cast<size_t>(part)];
    const Vertices mean = sums[0].plain / n;
    const double about_mean = squares.mean() - weights.dot((mean - target.mean()).rowwise().squaredNorm());
    summary.rms = std::sqrt(std::max(0.0, about_mean) / weights.sum());
    const double attention = sums[0].seen / (n * weights.sum());
    summary.unseen_share = options.unseen_weight < 1 ? (1 - attention) / (1 - options.unseen_weight) : 0;
    summary.last_change = target.move_to(sums[0].attention.cwiseInverse().asDiagonal() * sums[0].attentive);
    summary.converged = summary.last_change < options.tolerance;
    if (progress) progress({"alignment", summary.iterations, options.max_iterations, ""});
  }
  store.rewrite([&](Eigen::Index i, Eigen::RowVectorXd& row) {
    const Similarity& step = steps[static_cast<size_t>(i)];
    row = as_row(step.apply(as_shape(row)));
    return step;
  });
  return summary;
}

}  // namespace facewright
