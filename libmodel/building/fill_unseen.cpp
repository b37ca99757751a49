// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/fill_unseen.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "libmodel/building/held_out_modes.h"
#include "libmodel/building/incomplete_pca.h"
#include "libmodel/building/residual_field.h"
#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

constexpr double kLeastCorrelation = 0.1;  // below, neighbours have nothing to say
constexpr double kLeastNugget = 0.01;      // variance: neighbours are never taken to be noise-free

void check(const SampleMatrix& values, const SampleMatrix& visibility, const Vertices& V,
           const FillUnseenOptions& options) {
  const auto expect = [](bool ok, const std::string& what) {
    if (!ok) throw InvalidInput("fill unseen: " + what);
  };
  expect(visibility.rows() == values.rows() && visibility.cols() * 3 == values.cols(),
         "visibility is " + std::to_string(visibility.rows()) + " x " + std::to_string(visibility.cols()) +
             ", expected " + std::to_string(values.rows()) + " x " + std::to_string(values.cols() / 3));
  expect(V.rows() == 0 || V.rows() == visibility.cols(),
         "the surface has " + std::to_string(V.rows()) + " vertices, the samples " + std::to_string(visibility.cols()));
  expect(visibility.allFinite(), "visibility holds NaN or infinity");
  expect(visibility.size() == 0 || (visibility.minCoeff() >= 0 && visibility.maxCoeff() <= 1),
         "visibility must be within 0..1");
  expect(options.correlation_length >= 0, "correlation_length must not be negative");
  expect(options.max_iterations > 0 && options.tolerance > 0, "max_iterations and tolerance must be positive");
}

// Values of weight 0 may be anything, yet sums over all values must not meet a NaN.
void clear_unseen(Eigen::Ref<Eigen::RowVectorXd> row, const Eigen::Ref<const Eigen::RowVectorXd>& visibility,
                  const std::string& name) {
  if (row.allFinite()) return;
  for (Eigen::Index v = 0; v < visibility.size(); ++v) {
    auto x = row.segment<3>(3 * v);
    if (x.allFinite()) continue;
    if (visibility[v] > 0)
      throw InvalidInput("fill unseen: " + name + " holds NaN or infinity at vertex " + std::to_string(v) +
                         ", which was seen");
    x.setZero();
  }
}

SampleMatrix without_unseen(SampleMatrix values, const SampleMatrix& visibility) {
  for (Eigen::Index s = 0; s < values.rows(); ++s)
    clear_unseen(values.row(s), visibility.row(s), "sample " + std::to_string(s));
  return values;
}

double filled_share(const Eigen::Ref<const Eigen::RowVectorXd>& visibility, const std::vector<bool>& known,
                    double least) {
  double filled = 0;
  for (Eigen::Index v = 0; v < visibility.size(); ++v) filled += known[static_cast<size_t>(v)] && visibility[v] < least;
  return filled / static_cast<double>(std::max<Eigen::Index>(1, visibility.size()));
}

// Shares filled; returns which vertices somebody saw.
std::vector<bool> describe(const SampleMatrix& visibility, FillUnseenSummary* summary) {
  const double least = summary->options.min_visibility;
  std::vector<bool> known(static_cast<size_t>(visibility.cols()));
  for (Eigen::Index v = 0; v < visibility.cols(); ++v)
    known[static_cast<size_t>(v)] = visibility.col(v).maxCoeff() >= least;
  summary->never_seen = static_cast<int>(std::count(known.begin(), known.end(), false));
  for (Eigen::Index i = 0; i < visibility.rows(); ++i) {
    const double share = filled_share(visibility.row(i), known, least);
    summary->sample_shares.push_back(share);
    summary->filled_share += share / static_cast<double>(visibility.rows());
    if (share > summary->worst_sample_share) {
      summary->worst_sample_share = share;
      summary->worst_sample = static_cast<int>(i);
    }
  }
  return known;
}

Eigen::VectorXd predict(const IncompletePca& model, const ScorePosterior& scores) {
  return model.mean + model.factors * scores.mean;
}

Vertices residual_of(const Eigen::RowVectorXd& row, const Eigen::VectorXd& prediction, const Eigen::VectorXd& weights) {
  Vertices residual(weights.size(), 3);
  for (Eigen::Index v = 0; v < weights.size(); ++v)
    if (weights[v] > 0)
      residual.row(v) = row.segment<3>(3 * v) - prediction.segment<3>(3 * v).transpose();
    else
      residual.row(v).setZero();
  return residual;
}

// The expected values take the place of the unseen, sample by sample.
class Completion {
 public:
  Completion(const IncompletePca& model, const ResidualField* field, const std::vector<bool>& known, int threads)
      : model_(model), estimate_(model, threads), field_(field), known_(known), threads_(threads) {}

  double edge_correlation(const SampleMatrix& values, const SampleMatrix& weights) const {
    if (!field_) return 0;
    std::vector<ResidualField::Correlation> sums(static_cast<size_t>(values.rows()));
    parallel_for(static_cast<int>(values.rows()), threads_, [&](int s) {
      const Eigen::VectorXd prediction = predict(model_, estimate_(values.row(s), weights.row(s)));
      sums[static_cast<size_t>(s)] = field_->along_edges(
          residual_of(values.row(s), prediction, weights.row(s).transpose()), weights.row(s).transpose());
    });
    ResidualField::Correlation sum;
    for (const auto& s : sums) sum += s;
    return sum.value();
  }

  // Returns the posterior variance of the filled values, summed.
  double complete(Eigen::Ref<Eigen::RowVectorXd> row, const Eigen::Ref<const Eigen::RowVectorXd>& weights,
                  double edge_correlation) const {
    const ScorePosterior scores = estimate_(row, weights);
    Eigen::VectorXd prediction = predict(model_, scores);
    if (field_ && edge_correlation > kLeastCorrelation) {
      const double nugget = std::max(kLeastNugget, (1 - edge_correlation) / edge_correlation);
      const Eigen::VectorXd w = weights.transpose();
      const Vertices field = field_->expect(residual_of(row, prediction, w), w, nugget);
      prediction += Eigen::Map<const Eigen::VectorXd>(field.data(), field.size());
    }
    double variance = 0;
    for (Eigen::Index v = 0; v < weights.size(); ++v) {
      const double w = weights[v];
      if (w >= 1 || (!known_[static_cast<size_t>(v)] && !field_)) continue;
      auto x = row.segment<3>(3 * v);
      const auto expected = prediction.segment<3>(3 * v).transpose();
      x = w > 0 ? Eigen::RowVector3d(w * x + (1 - w) * expected) : Eigen::RowVector3d(expected);
      const auto B = model_.factors.middleRows<3>(3 * v);
      variance += (1 - w) * (3 * model_.noise + (B * scores.covariance * B.transpose()).trace());
    }
    return variance;
  }

 private:
  const IncompletePca& model_;
  ScoreEstimator estimate_;
  const ResidualField* field_;
  const std::vector<bool>& known_;
  int threads_;
};

// Mean and factors of vertices that nobody saw, from their neighbours.
void extend(IncompletePca* model, const ResidualField& field, const std::vector<bool>& known) {
  const Eigen::Index N = static_cast<Eigen::Index>(known.size()), K = model->mode_count();
  Eigen::MatrixXd rows(N, 3 * (K + 1));
  for (Eigen::Index v = 0; v < N; ++v)
    for (int c = 0; c < 3; ++c)
      rows.row(v).segment((K + 1) * c, K + 1) << model->mean[3 * v + c], model->factors.row(3 * v + c);
  field.fill_harmonically(rows, known);
  for (Eigen::Index v = 0; v < N; ++v)
    for (int c = 0; c < 3; ++c) {
      model->mean[3 * v + c] = rows(v, (K + 1) * c);
      model->factors.row(3 * v + c) = rows.row(v).segment((K + 1) * c + 1, K);
    }
}

double total_variance(const SampleMatrix& X) {
  const Eigen::RowVectorXd mean = X.colwise().mean();
  double sum = 0;
  for (Eigen::Index s = 0; s < X.rows(); ++s) sum += (X.row(s) - mean).squaredNorm();
  return sum;
}

}  // namespace

struct UnseenFill::Model {
  FillUnseenSummary summary;
  std::vector<bool> known;  // vertices somebody saw
  std::unique_ptr<ResidualField> field;
  IncompletePca statistics;
  std::unique_ptr<Completion> completion;

  void learn(const SampleMatrix& values, const SampleMatrix& visibility, const Vertices& V, const Faces& F) {
    const FillUnseenOptions& options = summary.options;
    summary.modes = options.modes;
    if (options.modes < 0) {
      const HeldOutModes chosen = choose_modes_by_hiding(values, visibility, V, options);
      summary.modes = chosen.modes;
      summary.held_out = chosen.error;
    }
    summary.modes = std::min(summary.modes, static_cast<int>(values.rows()) - 1);
    if (V.rows() > 0 && F.rows() > 0 && options.correlation_length > 0)
      field = std::make_unique<ResidualField>(V, F, options.correlation_length);
    statistics = fit_incomplete_pca(
        values, visibility, {summary.modes, options.max_iterations, options.tolerance, options.threads, field.get()});
    summary.noise = std::sqrt(statistics.noise);
    summary.iterations = statistics.iterations;
    summary.converged = statistics.converged;
    summary.last_change = statistics.last_change;
    if (field && summary.never_seen > 0) extend(&statistics, *field, known);
    completion = std::make_unique<Completion>(statistics, field.get(), known, options.threads);
    summary.edge_correlation = completion->edge_correlation(values, visibility);
  }
};

UnseenFill::UnseenFill(const SampleMatrix& values, const SampleMatrix& visibility, const Vertices& V, const Faces& F,
                       const FillUnseenOptions& options) {
  check(values, visibility, V, options);
  if (values.rows() == 0) throw InvalidInput("fill unseen: there are no samples to learn from");
  auto model = std::make_unique<Model>();
  model->summary.options = options;
  model->known = describe(visibility, &model->summary);
  if (values.allFinite())
    model->learn(values, visibility, V, F);
  else
    model->learn(without_unseen(values, visibility), visibility, V, F);
  model_ = std::move(model);
}

UnseenFill::~UnseenFill() = default;

double UnseenFill::complete(Eigen::Ref<Eigen::RowVectorXd> row, const Eigen::RowVectorXd& visibility) const {
  const auto n = static_cast<Eigen::Index>(model_->known.size());
  if (row.size() != 3 * n || visibility.size() != n)
    throw InvalidInput("fill unseen: the row has " + std::to_string(row.size()) + " values and " +
                       std::to_string(visibility.size()) + " weights, expected " + std::to_string(3 * n) + " and " +
                       std::to_string(n));
  if (!visibility.allFinite() || visibility.minCoeff() < 0 || visibility.maxCoeff() > 1)
    throw InvalidInput("fill unseen: visibility must be within 0..1");
  clear_unseen(row, visibility, "the sample");
  return model_->completion->complete(row, visibility, model_->summary.edge_correlation);
}

double UnseenFill::filled_share(const Eigen::RowVectorXd& visibility) const {
  return facewright::filled_share(visibility, model_->known, model_->summary.options.min_visibility);
}

const FillUnseenSummary& UnseenFill::summary() const { return model_->summary; }

FillUnseenResult fill_unseen(SampleMatrix values, const SampleMatrix& visibility, const Vertices& V, const Faces& F,
                             const FillUnseenOptions& options) {
  check(values, visibility, V, options);
  FillUnseenResult result;
  result.summary.options = options;
  values = without_unseen(std::move(values), visibility);
  if (visibility.size() > 0 && visibility.minCoeff() < 1) {
    const UnseenFill fill(values, visibility, V, F, options);
    result.summary = fill.summary();
    Eigen::VectorXd variances(values.rows());
    parallel_for(static_cast<int>(values.rows()), options.threads, [&](int i) {
      Eigen::RowVectorXd row = values.row(i);
      variances[i] = fill.complete(row, visibility.row(i));
      values.row(i) = row;
    });
    const double uncertain = variances.sum();
    if (uncertain > 0) result.summary.uncertain_share = uncertain / (uncertain + total_variance(values));
  } else {
    describe(visibility, &result.summary);
  }
  result.values = std::move(values);
  return result;
}

FillUnseenResult fill_unseen(SampleMatrix values, const SampleMatrix& visibility, const FillUnseenOptions& options) {
  return fill_unseen(std::move(values), visibility, {}, {}, options);
}

}  // namespace facewright
