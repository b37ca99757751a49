// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/metrics.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "libmodel/building/metric_distances.h"
#include "libmodel/building/pca.h"
#include "libmodel/building/procrustes.h"
#include "libmodel/building/sample_modes.h"
#include "libmodel/core/errors.h"

namespace facewright {

MetricsInput align_samples(MetricsInput input, const MetricsOptions& options) {
  check_metrics(input, options);
  if (options.alignment == FoldAlignment::none) return input;
  ProcrustesResult aligned = generalised_procrustes(std::move(input.samples), input.alignment_weights, input.reference,
                                                    {.scaling = options.scaling, .threads = options.threads});
  input.samples = std::move(aligned.shapes);
  for (Eigen::Index i = 0; i < input.targets.rows(); ++i) {
    Eigen::Map<Vertices> target(input.targets.row(i).data(), input.targets.cols() / 3, 3);
    target = aligned.mean_from_scans[static_cast<size_t>(i)].apply(target);
  }
  return input;
}

CompactnessResult compactness(const MetricsInput& input, const MetricsOptions& options) {
  check_metrics(input, options);
  const int n = static_cast<int>(input.samples.rows());
  std::vector<int> all(static_cast<size_t>(n));
  std::iota(all.begin(), all.end(), 0);
  const Eigen::RowVectorXd mean = mean_of_rows(input.samples, all);
  const Eigen::MatrixXd G = gram_matrix(input.samples, mean, options.threads);
  CompactnessResult result;
  result.variances = sample_modes(G, all, rounding_variance(mean)).variances;
  result.total_variance = n > 1 ? G.trace() / (n - 1) : 0;
  MetricCurve& curve = result.variance;
  curve.modes = mode_counts(options.modes, n - 1);
  const auto count = static_cast<Eigen::Index>(curve.modes.size());
  curve.value.resize(count);
  curve.standard_error.resize(count);
  result.share = Eigen::VectorXd::Zero(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index m = std::min<Eigen::Index>(curve.modes[static_cast<size_t>(i)], result.variances.size());
    curve.value[i] = result.variances.head(m).sum();
    curve.standard_error[i] = m > 0 ? std::sqrt(2.0 / (n - 1)) * result.variances.head(m).norm() : 0;
    if (m > 0) result.share[i] = curve.value[i] / result.total_variance;
  }
  return result;
}

MetricCurve ratio(const MetricCurve& a, const MetricCurve& b) {
  if (a.items.rows() != b.items.rows()) throw InvalidInput("metrics: a ratio needs curves of the same items");
  MetricCurve r;
  std::vector<double> values, errors;
  const auto n = static_cast<double>(a.items.rows());
  for (size_t i = 0; i < a.modes.size(); ++i) {
    const auto found = std::find(b.modes.begin(), b.modes.end(), a.modes[i]);
    const auto ia = static_cast<Eigen::Index>(i), ib = static_cast<Eigen::Index>(found - b.modes.begin());
    if (found == b.modes.end() || b.value[ib] <= 0) continue;
    r.modes.push_back(a.modes[i]);
    values.push_back(a.value[ia] / b.value[ib]);
    double error = 0;
    if (n > 1)
      error = (a.items.col(ia) - values.back() * b.items.col(ib)).norm() / std::sqrt(n * (n - 1)) / b.value[ib];
    errors.push_back(error);
  }
  r.value = Eigen::Map<Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  r.standard_error = Eigen::Map<Eigen::VectorXd>(errors.data(), static_cast<Eigen::Index>(errors.size()));
  return r;
}

}  // namespace facewright
