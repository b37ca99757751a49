// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

namespace facewright {

/// Indices of the ids in the order of their hashes: a draw that other ids beside them do not change.
std::vector<size_t> drawing_order(const std::vector<std::string>& ids);

/// The first `count` of that draw, in the order given; all, if there are not more.
std::vector<std::string> draw_ids(const std::vector<std::string>& ids, int count);

}  // namespace facewright
