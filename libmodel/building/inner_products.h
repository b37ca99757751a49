// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/registered_set.h"

namespace facewright {

// Private to this module: inner products of many rows. With the instructions of the machine at hand, yet with the same
// bytes on every machine and however the rows are cut, because each product is summed on its own, in order of columns.

/// Rows in panels of a few, column after column, in double.
class PackedRows {
 public:
  enum class Side { left, right };
  PackedRows(Side side, Eigen::Index rows, Eigen::Index cols);
  void set_row(Eigen::Index row, const float* values);

 private:
  friend void add_inner_products(const PackedRows& A, Eigen::Index first, const PackedRows& B,
                                 Eigen::Ref<SampleMatrix> sums);
  Eigen::Index rows_, cols_, width_;
  std::vector<double> values_;
};

/// sums (A's rows from `first`, a multiple of 4, on x B's rows) += A B'.
void add_inner_products(const PackedRows& A, Eigen::Index first, const PackedRows& B, Eigen::Ref<SampleMatrix> sums);

}  // namespace facewright
