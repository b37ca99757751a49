// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libregister/reference/half_face.h"

namespace facewright {

/// Fewer leave no room between the landmarks, more are a level and no base; our choice.
constexpr int least_reference_vertices = 200, most_reference_vertices = 20000;
/// Throws InvalidInput for a number of vertices outside these.
void check_vertex_count(int vertices);

struct RemeshOptions {
  int vertices = 845;  ///< of the whole face, both halves, hit exactly
  int rounds = 12;     ///< of splitting, collapsing, flipping and moving at the final count, >= 1; our choice
};

/// A new triangulation of a half face. The rows of `vertices_of` follow the list of fixed vertices given.
struct RemeshedHalf {
  HalfFace half;                 ///< source is -1 everywhere; size is the wanted length at that count, mm
  std::vector<int> vertices_of;  ///< the new vertex at each fixed vertex
};

/// Triangulates a half face anew, with edges as long as `size` asks (times a common factor) so that the whole face has
/// exactly the wanted number of vertices; edges are measured on `shape`, vertices stay on the surface by their place on
/// `neutral`. The vertices `fixed` stay, the midline, the mouth slit and the rim keep their course. Botsch and
/// Kobbelt's collapse, split, flip and tangential smoothing [botsch2004], from the finest mesh down. Deterministic;
/// about a second. Throws InvalidInput if the number cannot be reached.
RemeshedHalf remesh_half(const HalfFace& half, const std::vector<int>& fixed, const RemeshOptions& options = {});

/// Parts the lips on `shape` where they come nearer than `gap` mm (less towards the corner of the mouth), half each.
void part_lips(HalfFace& half, double gap);

}  // namespace facewright
