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

Vertices ModelRows::with_expression(const Eigen::VectorXd& neutral, const Eigen::VectorXd& expression) const {
  if (expressions() == 0) return as_vertices(neutral);
  Eigen::VectorXd x = neutral;
  if (expression_) x += expression_->instance(expression.head(expression_sigma_.size()), x.size() / 3);
  for (Eigen::Index m = 0; m < blendshape_count_; ++m)
    if (const double w = expression[expression_sigma_.size() + m]; w != 0)
      x += w * (*blendshapes_)[static_cast<size_t>(m)].displacement.head(x.size());
  return as_vertices(x);
}

}  // namespace facewright
