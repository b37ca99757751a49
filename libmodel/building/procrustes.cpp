// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/procrustes.h"

#include <cmath>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

using ShapeMap = Eigen::Map<Vertices>;

ShapeMap shape_of(SampleMatrix& shapes, Eigen::Index scan) {
  return ShapeMap(shapes.row(scan).data(), shapes.cols() / 3, 3);
}

void check(const SampleMatrix& shapes, const Eigen::VectorXd& weights, const Vertices& reference) {
  if (shapes.rows() == 0) throw InvalidInput("procrustes: there are no scans");
  if (shapes.cols() != reference.size() || weights.size() != reference.rows())
    throw InvalidInput("procrustes: scans have " + std::to_string(shapes.cols() / 3) + " vertices, the reference " +
                       std::to_string(reference.rows()) + ", the weights " + std::to_string(weights.size()));
  if (!weights.allFinite() || (weights.array() < 0).any())
    throw InvalidInput("procrustes: weights must be finite and not negative");
  for (Eigen::Index i = 0; i < shapes.rows(); ++i)
    if (!shapes.row(i).allFinite())
      throw InvalidInput("procrustes: scan " + std::to_string(i) + " of the set holds NaN or infinity");
}

// Weighted root mean square distance to the weighted centroid.
double centroid_size(const Vertices& V, const Eigen::VectorXd& weights) {
  const Eigen::RowVector3d centre = weights.transpose() * V / weights.sum();
  return std::sqrt(weights.dot((V.rowwise() - centre).rowwise().squaredNorm()) / weights.sum());
}

Vertices mean_shape(const SampleMatrix& shapes) {
  const Eigen::RowVectorXd mean = shapes.colwise().mean();
  return Eigen::Map<const Vertices>(mean.data(), mean.size() / 3, 3);
}

double weighted_rms(const SampleMatrix& shapes, const Vertices& mean, const Eigen::VectorXd& weights) {
  double sum = 0;
  for (Eigen::Index i = 0; i < shapes.rows(); ++i) {
    const Eigen::Map<const Vertices> shape(shapes.row(i).data(), mean.rows(), 3);
    sum += weights.dot((shape - mean).rowwise().squaredNorm());
  }
  return std::sqrt(sum / (weights.sum() * static_cast<double>(shapes.rows())));
}

}  // namespace

ProcrustesResult generalised_procrustes(SampleMatrix shapes, const Eigen::VectorXd& weights, const Vertices& reference,
                                        const ProcrustesOptions& options) {
  check(shapes, weights, reference);
  const int scan_count = static_cast<int>(shapes.rows());
  ProcrustesResult result;
  result.summary.options = options;
  result.mean_from_scans.resize(static_cast<size_t>(scan_count));
  Eigen::VectorXd sizes(scan_count);
  for (int i = 0; i < scan_count; ++i) sizes[i] = centroid_size(shape_of(shapes, i), weights);
  Vertices target = reference;
  if (options.scaling == Scaling::free) target *= sizes.mean() / centroid_size(reference, weights);
  for (int& iteration = result.summary.iterations; iteration < options.max_iterations && !result.summary.converged;) {
    ++iteration;
    parallel_for(scan_count, options.threads, [&](int i) {
      ShapeMap shape = shape_of(shapes, i);
      const Similarity step = fit_similarity(shape, target, weights, options.scaling);
      shape = step.apply(shape);
      Similarity& whole = result.mean_from_scans[static_cast<size_t>(i)];
      whole = step * whole;
    });
    Vertices mean = mean_shape(shapes);
    // The mean's frame and size drift unless pinned.
    Similarity gauge = fit_similarity(mean, reference, weights, Scaling::fixed);
    mean = gauge.apply(mean);
    if (options.scaling == Scaling::free) {
      const Eigen::RowVector3d centre = weights.transpose() * mean / weights.sum();
      mean = ((mean.rowwise() - centre) * (sizes.mean() / centroid_size(mean, weights))).rowwise() + centre;
    }
    result.summary.last_change = (mean - target).rowwise().norm().maxCoeff();
    result.summary.converged = result.summary.last_change < options.tolerance;
    target = mean;
  }
  result.mean = mean_shape(shapes);
  result.summary.rms = weighted_rms(shapes, result.mean, weights);
  result.shapes = std::move(shapes);
  return result;
}

}  // namespace facewright
