// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "libmodel/model/hdf5_archive.h"
#include "libmodel/model/pca_model.h"

namespace facewright {

// Private to this module.

/// What a reader of mean, basis and variances asks for.
struct StatisticsRequest {
  Eigen::Index values = -1;  ///< leading entries of the mean and rows of the basis; -1 = all
  bool orthonormal = true;   ///< refuse a basis that is not; false for rows cut off an orthonormal one
};

/// The statistics of the statismo model at `group` ("/shape"), of version 0.8 or 0.9, checked: sizes agree, numbers are
/// finite, variances >= 0 and descending, columns orthonormal (to 1e-3: what float32 and other programs' PCA leave).
/// Trailing modes without variance are left out. IoError names the dataset, what was expected and what to do.
PcaModel read_statistics(const Hdf5Reader& h5, const std::string& group, const StatisticsRequest& request = {});

/// One row or column of numbers.
Eigen::VectorXd read_column(const Hdf5Reader& h5, const std::string& path);

/// The dataset at `path` as one integer.
int read_integer(const Hdf5Reader& h5, const std::string& path);

}  // namespace facewright
