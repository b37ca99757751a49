// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/mesh.h"

namespace facewright {

/// The mesh with all vertices in a cubic cell of edge `cell` (mm, > 0) drawn together in their mean, colours too;
/// texture coordinates are dropped. Triangles within a cell vanish; no two run along an edge the same way.
/// [rossignac1993] Vertices come in the order in which their cells first appear. O(N + M).
Mesh thin_mesh(const Mesh& mesh, double cell);

/// A mesh of about `triangles` triangles or fewer, and the mesh itself if it has no more.
Mesh thin_mesh_to(const Mesh& mesh, Eigen::Index triangles);

}  // namespace facewright
