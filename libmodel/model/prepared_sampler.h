// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/model/pca_model.h"

namespace facewright {

/// A model made ready for many instances, one after the other: a copy of its basis in single precision, each mode times
/// its standard deviation, in the order in which it is read. Half as much to read as PcaModel::instance, which is what
/// an instance's time goes to; 12 N K bytes besides the model.
///
/// Terms are summed in single precision, the mean is added in double: with 60 modes an entry is within 2e-6 of the sum
/// of its terms' magnitudes, some 1e-5 mm for a face; not the same bytes as PcaModel::instance, but the same on every
/// machine.
class PreparedSampler {
 public:
  /// Throws InvalidInput as validate().
  explicit PreparedSampler(const PcaModel& model);

  Eigen::Index mode_count() const { return modes_; }
  Eigen::Index vertex_count() const { return mean_.size() / 3; }

  /// Vertices (or colours) of the instance with coefficients c in standard deviations into `out` (N x 3), whose memory
  /// is kept; shorter c as in PcaModel::instance. O(3N K).
  void instance(const Eigen::VectorXd& c, Vertices& out) const;
  Vertices instance(const Eigen::VectorXd& c) const;

 private:
  Eigen::Index modes_ = 0;
  Eigen::VectorXd mean_;
  std::vector<float, Eigen::aligned_allocator<float>> basis_;  ///< blocks of rows, each mode by mode
};

}  // namespace facewright
