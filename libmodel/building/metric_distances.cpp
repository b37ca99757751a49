// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/metric_distances.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "libmodel/core/errors.h"

namespace facewright {

void check_metrics(const MetricsInput& input, const MetricsOptions& options) {
  const auto expect = [](bool ok, const std::string& what) {
    if (!ok) throw InvalidInput("metrics: " + what);
  };
  const SampleMatrix& X = input.samples;
  expect(X.rows() > 0 && X.cols() > 0, "there are no samples");
  expect(X.cols() == 3 * input.distance_weights.size(), "samples have " + std::to_string(X.cols()) + " entries, " +
                                                            std::to_string(input.distance_weights.size()) +
                                                            " vertices have weights");
  expect(input.distance_weights.minCoeff() >= 0 && input.distance_weights.sum() > 0, "weights are negative or all 0");
  for (Eigen::Index i = 0; i < X.rows(); ++i)
    expect(X.row(i).allFinite(), "sample " + std::to_string(i) + " of the set holds NaN or infinity");
  expect(input.targets.size() == 0 || (input.targets.rows() == X.rows() && input.targets.cols() == X.cols()),
         "targets and samples differ in size");
  expect(input.targets.allFinite(), "a target holds NaN or infinity");
  expect(
      input.visibility.size() == 0 || (input.visibility.rows() == X.rows() && 3 * input.visibility.cols() == X.cols()),
      "visibility and samples differ in size");
  expect(input.F.size() == 0 || (input.F.minCoeff() >= 0 && 3 * input.F.maxCoeff() < X.cols()),
         "triangles name vertices that samples do not have");
  for (const int v : input.landmarks) expect(v >= 0 && 3 * v < X.cols(), "landmark vertex " + std::to_string(v));
  for (const int m : options.modes) expect(m >= 0, "mode counts must not be negative");
  expect(options.folds == 0 || options.folds >= 2, "folds must be 0 (leave one out) or at least 2");
  expect(options.samples >= 0 && options.surface_samples >= 0 && options.surface_vertices >= 0 && options.keep >= 0,
         "counts must not be negative");
}

std::vector<int> mode_counts(const std::vector<int>& wanted, int most) {
  std::vector<int> counts;
  if (wanted.empty())
    for (int m = 0; m <= most; ++m) counts.push_back(m);
  for (const int m : wanted)
    if (m <= most) counts.push_back(m);
  std::sort(counts.begin(), counts.end());
  counts.erase(std::unique(counts.begin(), counts.end()), counts.end());
  return counts;
}

MetricCurve curve_of(std::vector<int> modes, Eigen::MatrixXd items) {
  MetricCurve curve;
  const auto n = static_cast<double>(items.rows());
  curve.modes = std::move(modes);
  curve.value = items.colwise().mean();
  curve.standard_error = Eigen::VectorXd::Zero(items.cols());
  if (items.rows() > 1)
    curve.standard_error =
        ((items.rowwise() - curve.value.transpose()).colwise().squaredNorm() / (n * (n - 1))).cwiseSqrt();
  curve.items = std::move(items);
  return curve;
}

SurfaceProbe surface_probe(const MetricsInput& input, const MetricsOptions& options) {
  SurfaceProbe probe;
  if (input.F.rows() == 0 || options.surface_vertices == 0) return probe;
  const int n = static_cast<int>(input.distance_weights.size());
  std::vector<int> incident(static_cast<size_t>(n), -1);
  for (int f = static_cast<int>(input.F.rows()) - 1; f >= 0; --f)
    for (int k = 0; k < 3; ++k) incident[static_cast<size_t>(input.F(f, k))] = f;
  const int stride = std::max(1, (n + options.surface_vertices - 1) / options.surface_vertices);
  for (int v = 0; v < n; v += stride) {
    probe.vertices.push_back(v);
    probe.hints.push_back(incident[static_cast<size_t>(v)]);
  }
  probe.weights = input.distance_weights(probe.vertices);
  if (probe.weights.sum() <= 0) return {};
  probe.weights /= probe.weights.sum();
  return probe;
}

double surface_distance(const SurfaceIndex& surface, const SurfaceProbe& probe, const Vertices& points) {
  double sum = 0;
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    sum += probe.weights[i] *
           surface.nearest(Eigen::Vector3d(points.row(i)), probe.hints[static_cast<size_t>(i)]).distance;
  return sum;
}

Eigen::VectorXd sample_weights(const MetricsInput& input, Eigen::Index i) {
  Eigen::VectorXd w = input.distance_weights;
  if (input.visibility.size() > 0) w.array() *= input.visibility.row(i).transpose().array();
  const double sum = w.sum();
  return sum > 0 ? Eigen::VectorXd(w / sum) : Eigen::VectorXd::Zero(w.size());
}

}  // namespace facewright
