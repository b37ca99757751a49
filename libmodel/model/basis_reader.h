// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <string>

#include "libmodel/model/hdf5_archive.h"

namespace facewright {

// Private to this module.

/// Part of a stored basis, and what was seen of its numbers on the way.
struct BasisRows {
  Eigen::MatrixXd basis;  ///< (rows x modes)
  bool finite = true;
  /// Largest entry of B'(B r) - r for one fixed r with entries of 0.5 to 1.5 in size: 0 if all of B's columns are
  /// orthonormal, and only then but for r of measure zero. Of the rows that were read.
  double defect = 0;
};

/// The leading `rows` of the leading `modes` columns of the matrix at `path`, `stored` as its shape() says. Plain
/// float32 is taken from the file in blocks, converted and turned to columns while it is in the cache, by all threads;
/// the bytes do not depend on their number. O(rows modes).
BasisRows read_basis(const Hdf5Reader& h5, const std::string& path, const Hdf5Reader::Shape& stored, Eigen::Index rows,
                     Eigen::Index modes);

}  // namespace facewright
