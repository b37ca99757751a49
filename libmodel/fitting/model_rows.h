// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/fitting/fit_shape.h"
#include "libmodel/model/morphable_model.h"

namespace facewright {

/// The rows of a model at single vertices, columns [shape | expression modes | blendshapes], each mode times its
/// standard deviation. Refers to the model it is made from.
class ModelRows {
 public:
  /// The first `modes` shape modes (-1 = all); expression and blendshapes may be null.
  ModelRows(const PcaModel& shape, int modes, const PcaModel* expression,
            const std::vector<Blendshape>* blendshapes = nullptr);

  Eigen::Index shape_modes() const { return shape_sigma_.size(); }
  Eigen::Index expressions() const { return expression_sigma_.size() + blendshape_count_; }
  /// Room for K vertices.
  void resize(LandmarkShapeModel& out, Eigen::Index K) const;
  void put(LandmarkShapeModel& out, Eigen::Index k, int vertex) const;
  /// Vertices of the face whose leading neutral ones (3n) are given, with these expression coefficients. O(3n E).
  Vertices with_expression(const Eigen::VectorXd& neutral, const Eigen::VectorXd& expression) const;

 private:
  const PcaModel* shape_;
  const PcaModel* expression_;
  const std::vector<Blendshape>* blendshapes_;
  Eigen::RowVectorXd shape_sigma_, expression_sigma_;
  Eigen::Index blendshape_count_ = 0;
};

}  // namespace facewright
