// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/landmarks.h"
#include "libmodel/core/multires_template.h"

namespace facewright {

/// The same material point on another level. Bisection cuts triangles and moves nothing on the reference, so a point of
/// a coarse triangle lies in exactly one of its parts: there its barycentric coordinates follow from those of the
/// vertices, halves and thirds down the line of parents. On the reference the position stays the same (to rounding); on
/// a registered face or a model's mean it is the point at the same place of the level's surface. `coarse` (M x 3) are
/// the triangles the point refers to, of `coarse_count` vertices; parents[i] belongs to vertex coarse_count + i; `fine`
/// are the triangles of the level wanted. Throws InvalidInput if no fine triangle holds the point. O(N + M).
SurfacePoint carry_point(const SurfacePoint& point, const Faces& coarse, int coarse_count,
                         const std::vector<VertexParents>& parents, const Faces& fine);

/// The first triangle of F at vertex v with barycentric coordinates 1, 0, 0; triangle -1 if there is none.
SurfacePoint point_at_vertex(const Faces& F, int v);
/// The same of several vertices, in O(M).
std::vector<SurfacePoint> points_at_vertices(const Faces& F, const std::vector<int>& vertices);

}  // namespace facewright
