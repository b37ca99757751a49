// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/winding.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace facewright {
namespace {

struct Side {
  std::uint64_t edge;  // lower vertex * 2^32 + higher vertex
  int triangle;
  bool upward;  // from the lower vertex to the higher
};

std::vector<Side> sorted_sides(const Faces& F) {
  std::vector<Side> sides;
  sides.reserve(static_cast<size_t>(F.size()));
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      const int a = F(f, k), b = F(f, (k + 1) % 3);
      if (a == b) continue;
      const auto low = static_cast<std::uint64_t>(std::min(a, b)), high = static_cast<std::uint64_t>(std::max(a, b));
      sides.push_back({low << 32 | high, static_cast<int>(f), a < b});
    }
  std::sort(sides.begin(), sides.end(),
            [](const Side& a, const Side& b) { return a.edge != b.edge ? a.edge < b.edge : a.triangle < b.triangle; });
  return sides;
}

struct Neighbours {
  std::vector<std::array<int, 3>> of;  // -1: none
  std::vector<std::array<bool, 3>> agrees;
  bool all_agree = true;

  explicit Neighbours(Eigen::Index triangles)
      : of(static_cast<size_t>(triangles), {-1, -1, -1}), agrees(static_cast<size_t>(triangles)) {}
  void add(int a, int b, bool agree) {
    for (int k = 0; k < 3; ++k) {
      int& place = of[static_cast<size_t>(a)][static_cast<size_t>(k)];
      if (place >= 0) continue;
      place = b, agrees[static_cast<size_t>(a)][static_cast<size_t>(k)] = agree;
      break;
    }
  }
};

Neighbours neighbours(const Faces& F) {
  const std::vector<Side> sides = sorted_sides(F);
  Neighbours result(F.rows());
  for (size_t i = 0, end = 0; i < sides.size(); i = end) {
    for (end = i; end < sides.size() && sides[end].edge == sides[i].edge;) ++end;
    if (end - i != 2 || sides[i].triangle == sides[i + 1].triangle) continue;
    const bool agree = sides[i].upward != sides[i + 1].upward;
    result.all_agree = result.all_agree && agree;
    result.add(sides[i].triangle, sides[i + 1].triangle, agree);
    result.add(sides[i + 1].triangle, sides[i].triangle, agree);
  }
  return result;
}

}  // namespace

std::vector<int> inconsistent_triangles(const Faces& F) {
  const Neighbours near = neighbours(F);
  std::vector<int> turned;
  if (near.all_agree) return turned;
  std::vector<signed char> side(static_cast<size_t>(F.rows()), -1);
  for (int seed = 0; seed < F.rows(); ++seed) {
    if (side[static_cast<size_t>(seed)] >= 0) continue;
    std::vector<int> part = {seed};
    side[static_cast<size_t>(seed)] = 0;
    size_t ones = 0;
    for (size_t at = 0; at < part.size(); ++at) {
      const auto f = static_cast<size_t>(part[at]);
      ones += side[f] == 1;
      for (size_t k = 0; k < 3; ++k) {
        const int g = near.of[f][k];
        if (g < 0 || side[static_cast<size_t>(g)] >= 0) continue;
        side[static_cast<size_t>(g)] = near.agrees[f][k] ? side[f] : static_cast<signed char>(1 - side[f]);
        part.push_back(g);
      }
    }
    const signed char minority = 2 * ones > part.size() ? 0 : 1;
    for (const int f : part)
      if (side[static_cast<size_t>(f)] == minority) turned.push_back(f);
  }
  std::sort(turned.begin(), turned.end());
  return turned;
}

}  // namespace facewright
