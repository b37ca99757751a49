// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/model_rows.h"

#include <algorithm>

namespace facewright {

ModelRows::ModelRows(const PcaModel& shape, int modes, const PcaModel* expression,
                     const std::vector<Blendshape>* blendshapes)
    : shape_(&shape), expression_(expression), blendshapes_(blendshapes) {
  const Eigen::Index available = shape.mode_count();
  shape_sigma_ = shape.variances.head(modes < 0 ? available : std::min<Eigen::Index>(modes, available)).cwiseSqrt();
  if (expression) expression_sigma_ = expression->variances.cwiseSqrt();
  if (blendshapes) blendshape_count_ = static_cast<Eigen::Index>(blendshapes->size());
}

void ModelRows::resize(LandmarkShapeModel& out, Eigen::Index K) const {
  out.mean.resize(3 * K);
  out.basis.resize(3 * K, shape_modes() + expressions());
}

void ModelRows::put(LandmarkShapeModel& out, Eigen::Index k, int vertex) const {
  const Eigen::Index to = 3 * k, from = 3 * Eigen::Index{vertex}, M = shape_modes(), E = expression_sigma_.size();
  out.mean.segment<3>(to) = shape_->mean.segment<3>(from);
  for (Eigen::Index m = 0; m < M; ++m)
    out.basis.col(m).segment<3>(to) = shape_sigma_[m] * shape_->basis.col(m).segment<3>(from);
  if (expression_) out.mean.segment<3>(to) += expression_->mean.segment<3>(from);
  for (Eigen::Index m = 0; m < E; ++m)
    out.basis.col(M + m).segment<3>(to) = expression_sigma_[m] * expression_->basis.col(m).segment<3>(from);
  for (Eigen::Index m = 0; m < blendshape_count_; ++m)
    out.basis.col(M + E + m).segment<3>(to) = (*blendshapes_)[static_cast<size_t>(m)].displacement.segment<3>(from);
}

Vertices ModelRows::instance(const Eigen::VectorXd& shape, const Eigen::VectorXd& expression,
                             Eigen::Index vertices) const {
  Eigen::VectorXd x = shape_->instance(shape, vertices);
  if (expression_) x += expression_->instance(expression.head(expression_sigma_.size()), vertices);
  for (Eigen::Index m = 0; m < blendshape_count_; ++m)
    if (const double w = expression[expression_sigma_.size() + m]; w != 0)
      x += w * (*blendshapes_)[static_cast<size_t>(m)].displacement.head(3 * vertices);
  return as_vertices(x);
}

}  // namespace facewright
