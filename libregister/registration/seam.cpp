// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/seam.h"

#include <algorithm>

#include "libmodel/core/topology.h"

namespace facewright {
namespace {

// The inner boundary loop most of whose vertices belong to the region.
std::vector<int> slit_loop(const Faces& F, const std::vector<int>& region) {
  const auto loops = boundary_loops(F);
  for (size_t l = 1; l < loops.size(); ++l) {
    const auto inside = std::count_if(loops[l].begin(), loops[l].end(),
                                      [&](int v) { return std::binary_search(region.begin(), region.end(), v); });
    if (2 * inside > static_cast<std::ptrdiff_t>(loops[l].size())) return loops[l];
  }
  return {};
}

// The point of a chain (ascending in x) at the given x.
Stitch facing(int vertex, double x, const std::vector<int>& chain, const Vertices& V) {
  for (size_t k = 0; k + 1 < chain.size(); ++k) {
    const double x0 = V(chain[k], 0), x1 = V(chain[k + 1], 0);
    if (x <= x1 || k + 2 == chain.size())
      return {vertex, chain[k], chain[k + 1], x1 > x0 ? std::clamp((x - x0) / (x1 - x0), 0.0, 1.0) : 0.5};
  }
  return {};
}

}  // namespace

std::vector<Stitch> seam_stitches(const MultiresTemplate& reference, int level) {
  const auto region = reference.regions.find("mouth_slit");
  if (region == reference.regions.end()) return {};
  std::vector<int> loop = slit_loop(reference.levels[static_cast<size_t>(level)].F, region->second);
  if (loop.size() < 6) return {};
  const Vertices& V = reference.V;
  const auto by_x = [&](int a, int b) { return V(a, 0) < V(b, 0); };
  std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end(), by_x), loop.end());
  const auto right_end = std::max_element(loop.begin(), loop.end(), by_x);
  std::vector<int> one(loop.begin(), right_end + 1), other(right_end, loop.end());
  other.push_back(loop.front());
  std::reverse(other.begin(), other.end());
  std::vector<Stitch> stitches;
  for (size_t k = 1; k + 1 < one.size(); ++k) stitches.push_back(facing(one[k], V(one[k], 0), other, V));
  for (size_t k = 1; k + 1 < other.size(); ++k) stitches.push_back(facing(other[k], V(other[k], 0), one, V));
  return stitches;
}

}  // namespace facewright
