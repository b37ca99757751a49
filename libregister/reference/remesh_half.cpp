// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/reference/remesh_half.h"

#include <algorithm>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libregister/reference/half_remesher.h"

namespace facewright {
namespace {

void settle(HalfRemesher& mesh, int rounds) {
  for (int i = 0; i < rounds; ++i) {
    mesh.flip_edges();
    mesh.smooth();
  }
}

[[noreturn]] void refuse(int wanted, int reached) {
  throw InvalidInput("remesh: " + std::to_string(wanted) + " vertices cannot be had, " + std::to_string(reached) +
                     " came nearest; landmarks and borders stay, so a face needs some more than they have");
}

// Height of a chain at the abscissa x, over its ascending x.
double height_at(const HalfFace& half, const std::vector<int>& chain, double x) {
  for (size_t k = 0; k + 1 < chain.size(); ++k) {
    const double x0 = half.shape(chain[k], 0), x1 = half.shape(chain[k + 1], 0);
    if (x > x1 && k + 2 < chain.size()) continue;
    const double t = x1 > x0 ? std::clamp((x - x0) / (x1 - x0), 0.0, 1.0) : 0;
    return (1 - t) * half.shape(chain[k], 1) + t * half.shape(chain[k + 1], 1);
  }
  return 0;
}

}  // namespace

void check_vertex_count(int vertices) {
  if (vertices < least_reference_vertices || vertices > most_reference_vertices)
    throw InvalidInput("reference: the number of vertices must lie within " + std::to_string(least_reference_vertices) +
                       " .. " + std::to_string(most_reference_vertices) + ", got " + std::to_string(vertices));
}

RemeshedHalf remesh_half(const HalfFace& half, const std::vector<int>& fixed, const RemeshOptions& options) {
  check_vertex_count(options.vertices);
  if (options.rounds < 1) throw InvalidInput("remesh: rounds must be at least 1");
  HalfRemesher mesh(half, fixed);
  while (mesh.whole_count() > options.vertices + 2) {
    const int before = mesh.whole_count();
    mesh.thin_out(std::max(options.vertices, before * 6 / 10));
    settle(mesh, 2);
    if (mesh.whole_count() > before * 99 / 100) break;
  }
  for (int round = 0; round < options.rounds; ++round) {
    mesh.split_long(1.5);
    mesh.collapse_short(0.6);
    if (!mesh.reach(options.vertices)) refuse(options.vertices, mesh.whole_count());
    settle(mesh, 4);
    for (int i = 0; i < 2; ++i) {
      mesh.flip_edges();
      mesh.improve_worst(2 * round + i);
    }
  }
  for (int i = 0; i < 25; ++i) {
    mesh.flip_edges();
    mesh.improve_worst(i);
  }
  RemeshedHalf result;
  result.half = mesh.result(fixed, &result.vertices_of);
  return result;
}

void part_lips(HalfFace& half, double gap) {
  const auto [upper, lower] = lip_margins(half);
  if (upper.size() < 2 || lower.size() < 2) return;
  const double corner = half.shape(upper.back(), 0);
  for (int round = 0; round < 10; ++round) {
    const HalfFace before = half;
    const auto part = [&](const std::vector<int>& chain, const std::vector<int>& other, double sign) {
      for (size_t k = 0; k + 1 < chain.size(); ++k) {
        const double x = before.shape(chain[k], 0), wanted = std::min(gap, 0.2 * (corner - x));
        const double missing = wanted - sign * (before.shape(chain[k], 1) - height_at(before, other, x));
        if (missing > 0) half.shape(chain[k], 1) += 0.5 * sign * missing;
      }
    };
    part(upper, lower, 1);
    part(lower, upper, -1);
  }
}

}  // namespace facewright
