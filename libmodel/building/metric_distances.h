// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/building/metrics.h"
#include "libmodel/surface/nearest.h"

namespace facewright {

// Private to this module: what the metrics have in common.

/// Throws InvalidInput unless sizes agree, numbers are finite and options in range.
void check_metrics(const MetricsInput& input, const MetricsOptions& options);

/// Mode counts to measure at: those asked for that are at most `most`, or 0 .. most.
std::vector<int> mode_counts(const std::vector<int>& wanted, int most);

/// The mean over items (rows) and its standard error.
MetricCurve curve_of(std::vector<int> modes, Eigen::MatrixXd items);

/// Vertices that surface distances are taken at, and where to look first.
struct SurfaceProbe {
  std::vector<int> vertices;  ///< evenly strided
  std::vector<int> hints;     ///< a triangle at each
  Eigen::VectorXd weights;    ///< of the mean, sum 1
  bool empty() const { return vertices.empty(); }
};
SurfaceProbe surface_probe(const MetricsInput& input, const MetricsOptions& options);

/// Weighted mean distance of points (one row per probe vertex) to the surface.
double surface_distance(const SurfaceIndex& surface, const SurfaceProbe& probe, const Vertices& points);

/// Weights over vertices of sample i, sum 1 (all 0 if nothing of it was seen).
Eigen::VectorXd sample_weights(const MetricsInput& input, Eigen::Index i);

}  // namespace facewright
