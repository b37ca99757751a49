// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "libmodel/core/similarity.h"

namespace facewright {

// Private to this module: what a sample store holds.

struct IndexedSample {
  Eigen::Index slot = 0;  ///< row of the file
  std::string id;
  Similarity mean_from_scan;
};

struct SampleIndex {
  Eigen::Index cols = 0;
  int generation = 0;                  ///< of the files of rows and products
  Eigen::Index slots = 0;              ///< rows written, removed ones included
  Eigen::Index product_rows = 0;       ///< slots whose products with all before them are written
  std::vector<IndexedSample> samples;  ///< slots ascend
};

std::string to_text(const SampleIndex& index);
/// Throws IoError with the line.
SampleIndex read_index(const std::filesystem::path& path);

}  // namespace facewright
