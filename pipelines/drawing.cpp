// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/drawing.h"

#include <algorithm>
#include <utility>

#include "libmodel/io/sha256.h"

namespace facewright {

std::vector<size_t> drawing_order(const std::vector<std::string>& ids) {
  std::vector<std::pair<std::string, size_t>> hashed;
  for (size_t i = 0; i < ids.size(); ++i) hashed.emplace_back(sha256(ids[i]), i);
  std::sort(hashed.begin(), hashed.end());
  std::vector<size_t> order;
  for (const auto& [hash, i] : hashed) order.push_back(i);
  return order;
}

std::vector<std::string> draw_ids(const std::vector<std::string>& ids, int count) {
  std::vector<size_t> drawn = drawing_order(ids);
  drawn.resize(std::min(drawn.size(), static_cast<size_t>(count)));
  std::sort(drawn.begin(), drawn.end());
  std::vector<std::string> some;
  for (const size_t i : drawn) some.push_back(ids[i]);
  return some;
}

}  // namespace facewright
