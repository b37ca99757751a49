// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <utility>

namespace facewright {

// Private to this module: the columns of a sample matrix in blocks that stay in the cache, the same for any number of
// threads.

inline constexpr Eigen::Index kColumnBlock = 512;

inline int column_block_count(Eigen::Index cols) { return static_cast<int>((cols + kColumnBlock - 1) / kColumnBlock); }

/// First column and number of columns.
inline std::pair<Eigen::Index, Eigen::Index> column_block(Eigen::Index cols, Eigen::Index block) {
  return {block * kColumnBlock, std::min(kColumnBlock, cols - block * kColumnBlock)};
}

}  // namespace facewright
