// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/procrustes.h"

#include <cmath>
#include <string>
#include <utility>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

using ShapeMap = Eigen::Map<Vertices>;

ShapeMap shape_of(SampleMatrix& shapes, Eigen::Index scan) {
  return ShapeMap(shapes.row(scan).data(), shapes.cols() / 3, 3);
}

void check(const SampleMatrix& shapes, const Eigen::VectorXd& weights, const Vertices& reference,
           const SampleMatrix& visibility, double unseen_weight) {
  if (shapes.rows() == 0) throw InvalidInput("procrustes: there are no scans");
  if (shapes.cols() != reference.size() || weights.size() != reference.rows())
    throw InvalidInput("procrustes: scans have " + std::to_string(shapes.cols() / 3) + " vertices, the reference " +
                       std::to_string(reference.rows()) + ", the weights " + std::to_string(weights.size()));
  if (!weights.allFinite() || (weights.array() < 0).any())
    throw InvalidInput("procrustes: weights must be finite and not negative");
  if (visibility.size() > 0 && (visibility.rows() != shapes.rows() || visibility.cols() != weights.size() ||
                                !visibility.allFinite() || visibility.minCoeff() < 0 || visibility.maxCoeff() > 1))
    throw InvalidInput("procrustes: visibility must be 0..1 for every vertex of every scan");
  if (!(unseen_weight > 0 && unseen_weight <= 1)) throw InvalidInput("procrustes: expected 0 < unseen_weight <= 1");
  for (Eigen::Index i = 0; i < shapes.rows(); ++i)
    if (!shapes.row(i).allFinite())
      throw InvalidInput("procrustes: scan " + std::to_string(i) + " of the set holds NaN or infinity");
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

// How much each vertex of each scan counts (S x N), and the mean of the shapes by it.
SampleMatrix attention_to(const SampleMatrix& visibility, double unseen_weight) {
  return (unseen_weight + (1 - unseen_weight) * visibility.array()).matrix();
}

Vertices attentive_mean(const SampleMatrix& shapes, const SampleMatrix& attention, int threads) {
  if (attention.size() == 0) return mean_shape(shapes);
  Vertices mean(shapes.cols() / 3, 3);
  parallel_blocks(static_cast<int>(mean.rows()), threads, [&](int first, int last) {
    for (int v = first; v < last; ++v) {
      mean.row(v).setZero();
      for (Eigen::Index i = 0; i < shapes.rows(); ++i) mean.row(v) += attention(i, v) * shapes.row(i).segment<3>(3 * v);
      mean.row(v) /= attention.col(v).sum();
    }
  });
  return mean;
}

}  // namespace

double centroid_size(const Vertices& V, const Eigen::VectorXd& weights) {
  const Eigen::RowVector3d centre = weights.transpose() * V / weights.sum();
  return std::sqrt(weights.dot((V.rowwise() - centre).rowwise().squaredNorm()) / weights.sum());
}

ProcrustesTarget::ProcrustesTarget(const Vertices& reference, const Eigen::VectorXd& weights, Scaling scaling,
                                   double size)
    : reference_(reference), mean_(reference), weights_(weights), scaling_(scaling), size_(size) {
  if (scaling == Scaling::free) mean_ *= size / centroid_size(reference, weights);
}

double ProcrustesTarget::move_to(Vertices mean) {
  mean = fit_similarity(mean, reference_, weights_, Scaling::fixed).apply(mean);
  if (scaling_ == Scaling::free) {
    const Eigen::RowVector3d centre = weights_.transpose() * mean / weights_.sum();
    mean = ((mean.rowwise() - centre) * (size_ / centroid_size(mean, weights_))).rowwise() + centre;
  }
  const double change = (mean - mean_).rowwise().norm().maxCoeff();
  mean_ = std::move(mean);
  return change;
}

ProcrustesResult generalised_procrustes(SampleMatrix shapes, const Eigen::VectorXd& weights, const Vertices& reference,
                                        const ProcrustesOptions& options, const SampleMatrix& visibility) {
  check(shapes, weights, reference, visibility, options.unseen_weight);
  const int scan_count = static_cast<int>(shapes.rows());
  ProcrustesResult result;
  result.summary.options = options;
  result.mean_from_scans.resize(static_cast<size_t>(scan_count));
  SampleMatrix attention;
  if (visibility.size() > 0) {
    attention = attention_to(visibility, options.unseen_weight);
    result.summary.unseen_share = 1 - (visibility * weights).mean() / weights.sum();
  }
  Eigen::VectorXd sizes(scan_count);
  for (int i = 0; i < scan_count; ++i) sizes[i] = centroid_size(shape_of(shapes, i), weights);
  ProcrustesTarget target(reference, weights, options.scaling, sizes.mean());
  for (int& iteration = result.summary.iterations; iteration < options.max_iterations && !result.summary.converged;) {
    ++iteration;
    parallel_for(scan_count, options.threads, [&](int i) {
      ShapeMap shape = shape_of(shapes, i);
      const Similarity step = attention.size() == 0
                                  ? fit_similarity(shape, target.mean(), weights, options.scaling)
                                  : fit_similarity(shape, target.mean(),
                                                   weights.cwiseProduct(attention.row(i).transpose()), options.scaling);
      shape = step.apply(shape);
      Similarity& whole = result.mean_from_scans[static_cast<size_t>(i)];
      whole = step * whole;
    });
    // The mean's frame and size drift unless pinned.
    result.summary.last_change = target.move_to(attentive_mean(shapes, attention, options.threads));
    result.summary.converged = result.summary.last_change < options.tolerance;
  }
  result.mean = mean_shape(shapes);
  result.summary.rms = weighted_rms(shapes, result.mean, weights);
  result.shapes = std::move(shapes);
  return result;
}

}  // namespace facewright
