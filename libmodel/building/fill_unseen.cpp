// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/fill_unseen.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "libmodel/building/pca.h"
#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

struct Missing {
  std::vector<std::vector<int>> seen, unseen;  // vertices per sample; vertices nobody saw are in neither
};

Missing find_missing(const SampleMatrix& visibility, const FillUnseenOptions& options, FillUnseenSummary& summary) {
  const Eigen::Index samples = visibility.rows(), n = visibility.cols();
  const Eigen::RowVectorXd best = visibility.colwise().maxCoeff();
  summary.never_seen = static_cast<int>((best.array() < options.min_visibility).count());
  Missing missing{std::vector<std::vector<int>>(static_cast<size_t>(samples)),
                  std::vector<std::vector<int>>(static_cast<size_t>(samples))};
  size_t filled = 0;
  for (Eigen::Index i = 0; i < samples; ++i) {
    auto &seen = missing.seen[static_cast<size_t>(i)], &unseen = missing.unseen[static_cast<size_t>(i)];
    for (int v = 0; v < n; ++v)
      if (best[v] >= options.min_visibility) (visibility(i, v) >= options.min_visibility ? seen : unseen).push_back(v);
    filled += unseen.size();
    const double share = static_cast<double>(unseen.size()) / static_cast<double>(n);
    if (share > summary.worst_sample_share || summary.worst_sample < 0) {
      summary.worst_sample_share = share;
      summary.worst_sample = static_cast<int>(i);
    }
  }
  summary.filled_share = static_cast<double>(filled) / static_cast<double>(samples * n);
  return missing;
}

// The start: the mean over those who saw the vertex, shifted by how the sample differs from the mean where it was seen.
void initialise(SampleMatrix& values, const Missing& missing) {
  const Eigen::Index n = values.cols() / 3;
  Vertices mean = Vertices::Zero(n, 3);
  Eigen::VectorXd count = Eigen::VectorXd::Zero(n);
  for (size_t i = 0; i < missing.seen.size(); ++i)
    for (int v : missing.seen[i]) {
      mean.row(v) += values.row(static_cast<Eigen::Index>(i)).segment<3>(3 * v);
      count[v] += 1;
    }
  mean.array().colwise() /= count.array().max(1);
  for (size_t i = 0; i < missing.seen.size(); ++i) {
    auto row = values.row(static_cast<Eigen::Index>(i));
    Eigen::RowVector3d shift = Eigen::RowVector3d::Zero();
    for (int v : missing.seen[i]) shift += row.segment<3>(3 * v) - mean.row(v);
    shift /= std::max<double>(1, static_cast<double>(missing.seen[i].size()));
    for (int v : missing.unseen[i]) row.segment<3>(3 * v) = mean.row(v) + shift;
  }
}

// Posterior mean of the unseen entries of one sample given its seen ones; returns the sum of squared changes.
double complete(Eigen::Ref<Eigen::RowVectorXd> row, const std::vector<int>& seen, const std::vector<int>& unseen,
                const PcaModel& model, const SampleMatrix& W, double noise) {
  const Eigen::Index k = W.cols();
  Eigen::MatrixXd A = noise * Eigen::MatrixXd::Identity(k, k);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(k);
  SampleMatrix rows(static_cast<Eigen::Index>(3 * seen.size()), k);
  Eigen::VectorXd residual(rows.rows());
  for (size_t s = 0; s < seen.size(); ++s) {
    const Eigen::Index to = static_cast<Eigen::Index>(3 * s), from = 3 * Eigen::Index(seen[s]);
    rows.middleRows<3>(to) = W.middleRows<3>(from);
    residual.segment<3>(to) = row.segment<3>(from).transpose() - model.mean.segment<3>(from);
  }
  A.noalias() += rows.transpose() * rows;
  b.noalias() = rows.transpose() * residual;
  const Eigen::VectorXd c = A.llt().solve(b);
  double change = 0;
  for (int v : unseen) {
    const Eigen::Vector3d x = model.mean.segment<3>(3 * v) + W.middleRows<3>(3 * Eigen::Index(v)) * c;
    change += (row.segment<3>(3 * v).transpose() - x).squaredNorm();
    row.segment<3>(3 * v) = x.transpose();
  }
  return change;
}

}  // namespace

FillUnseenResult fill_unseen(SampleMatrix values, const SampleMatrix& visibility, const FillUnseenOptions& options) {
  if (visibility.rows() != values.rows() || visibility.cols() * 3 != values.cols())
    throw InvalidInput("fill unseen: visibility is " + std::to_string(visibility.rows()) + " x " +
                       std::to_string(visibility.cols()) + ", expected " + std::to_string(values.rows()) + " x " +
                       std::to_string(values.cols() / 3));
  FillUnseenResult result;
  FillUnseenSummary& summary = result.summary;
  summary.options = options;
  const Missing missing = find_missing(visibility, options, summary);
  const int samples = static_cast<int>(values.rows());
  size_t unknown = 0;
  for (const auto& list : missing.unseen) unknown += 3 * list.size();
  if (unknown > 0) {
    initialise(values, missing);
    PcaOptions pca;
    pca.threads = options.threads;
    pca.variance_share = 1;
    pca.max_modes = std::clamp(samples / 3, 1, options.modes);
    summary.converged = false;
    while (summary.iterations < options.max_iterations && !summary.converged) {
      ++summary.iterations;
      const PcaResult fit = fit_pca(values, pca);
      if (fit.summary.mode_count == 0) break;
      const double rest = fit.summary.total_variance - fit.summary.kept_variance;
      const double noise = std::max(rest / static_cast<double>(values.cols()), 1e-12 * fit.summary.total_variance);
      const SampleMatrix W = fit.model.rescaled_basis();
      std::vector<double> changes(static_cast<size_t>(samples), 0);
      parallel_for(samples, options.threads, [&](int i) {
        const auto s = static_cast<size_t>(i);
        if (missing.unseen[s].empty()) return;
        Eigen::RowVectorXd row = values.row(i);
        changes[s] = complete(row, missing.seen[s], missing.unseen[s], fit.model, W, noise);
        values.row(i) = row;
      });
      double sum = 0;
      for (double c : changes) sum += c;
      summary.last_change = std::sqrt(sum / static_cast<double>(unknown));
      summary.converged = summary.last_change < options.tolerance;
    }
  }
  result.values = std::move(values);
  return result;
}

}  // namespace facewright
