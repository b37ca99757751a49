// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

#include "libmodel/core/mesh.h"

namespace facewright {

/// Unit normals of the triangles, (M x 3), outward for counter-clockwise faces; zero for degenerate ones.
Vertices face_normals(const Vertices& V, const Faces& F);
/// Areas of the triangles, (M), square millimetres.
Eigen::VectorXd face_areas(const Vertices& V, const Faces& F);
/// Unit vertex normals, (N x 3): area-weighted mean of the incident triangles; zero where there are none.
Vertices vertex_normals(const Vertices& V, const Faces& F);
/// A third of the incident triangles' area per vertex, (N): the lumped (barycentric) mass.
Eigen::VectorXd vertex_areas(const Vertices& V, const Faces& F);
/// Mean edge length over triangle sides, millimetres; 0 for an empty mesh.
double mean_edge_length(const Vertices& V, const Faces& F);
/// Mean length of the triangle sides at each vertex, (N).
Eigen::VectorXd vertex_edge_lengths(const Vertices& V, const Faces& F);

}  // namespace facewright
