// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/mesh.h"
#include "libmodel/core/random.h"
#include "libmodel/core/similarity.h"

// Meshes with known answers. All are in millimetres, triangles counter-clockwise from outside (+z for flat ones).
namespace facewright {

/// A flat rectangle [0, width] x [0, height] at z = 0 with (columns x rows) cells of two triangles. V = (c+1)(r+1).
Mesh plane_grid(int columns, int rows, double width, double height);

/// A closed sphere about the origin: an icosahedron split `subdivisions` times; 10 * 4^s + 2 vertices, all at `radius`.
Mesh icosphere(int subdivisions, double radius);

/// The part of a sphere with z >= 0, in `rings` rings of `segments` around a pole at (0, 0, radius): one border.
/// V = 1 + rings * segments, the last ring on z = 0.
Mesh hemisphere(int rings, int segments, double radius);

/// A cylinder about the y axis seen from +z: angles -half_angle .. half_angle (radians), y in [0, height].
/// Developable: geodesics are straight lines in (radius * angle, y). V = (c+1)(r+1), the grid of plane_grid.
Mesh cylinder_patch(int columns, int rows, double radius, double half_angle, double height);

/// A flat ring inner <= |(x, y)| <= outer: Euler characteristic 0 and two borders, as a face with a mouth slit.
/// V = (rings + 1) * segments, ring by ring from the inside.
Mesh annulus(int rings, int segments, double inner, double outer);

/// Uniform over the rotations (Shoemake's quaternions).
Eigen::Matrix3d random_rotation(Random& random);
/// Rotation, scale in [0.5, 2], and a shift of up to `shift` mm per axis.
Similarity random_similarity(Random& random, double shift = 100);
/// (n x 3), each coordinate normal with `sigma`.
Vertices random_points(Random& random, Eigen::Index n, double sigma);

}  // namespace facewright
