// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/core/multires_template.h"

namespace facewright {

/// The subject's left half (x >= 0) of a symmetric face, in two shapes: the neutral one, which is clean everywhere (its
/// lips are a millimetre apart), and the face proper. Surfaces are worked on through the neutral shape and measured on
/// the face.
struct HalfFace {
  Vertices neutral;           ///< (N x 3) mm; x = 0 exactly on the midline
  Vertices shape;             ///< (N x 3) mm; x = 0 exactly on the midline
  Faces F;                    ///< (M x 3)
  Eigen::VectorXd size;       ///< (N) wanted edge length on `shape`, mm, up to a common factor
  std::vector<bool> midline;  ///< (N)
  std::vector<bool> slit;     ///< (N) on a lip's margin of the mouth slit
  std::vector<int> source;    ///< (N) the vertex it was cut from, -1 for vertices made here

  int count() const { return static_cast<int>(size.size()); }
};

/// Cuts the left half out of a symmetric reference whose finest level has the positions `shape` (N x 3), mirrored
/// exactly. The wanted edge length is that of the base mesh on `shape`. Throws InvalidInput if a triangle crosses the
/// midline.
HalfFace left_half(const MultiresTemplate& reference, const Vertices& shape);

/// Closes the mouth slit by a strip of triangles between the lips.
HalfFace close_mouth(const HalfFace& half);

/// Geodesic distances over the mouth-closed surface `shape` from a vertex, (N) mm: fast marching on the triangles
/// [kimmel1998], exact on flat ones up to about a percent.
Eigen::VectorXd geodesic_distances(const HalfFace& half, int source);

/// Cuts the half along the line field = level (field (N), linear over triangles) and keeps the part below that holds
/// the vertex `keep`. Throws InvalidInput if the vertex lies beyond the line.
HalfFace crop(const HalfFace& half, const Eigen::VectorXd& field, double level, int keep);

/// A new vertex on the edge (a, b) at (1 - t) a + t b, splitting the triangles beside it; its index.
int split_edge(HalfFace& half, int a, int b, double t);
/// A new vertex inside triangle f, which is split in three; its index.
int split_triangle(HalfFace& half, int f, const Eigen::Vector3d& barycentric);

/// Border of the half as one loop in the order of its half-edges. Throws InvalidInput if there is not exactly one.
std::vector<int> border_loop(const HalfFace& half);

/// Both halves of a face. Partners agree to the last bit; positions are rounded to 0.1 micrometre, as files have them.
struct MirroredFace {
  Vertices V;  ///< (N x 3) `shape`; a midline vertex once, any other and its image next to each other
  Faces F;
  std::vector<int> mirror;  ///< (N)
  std::vector<int> left;    ///< per vertex of the half, its row in V
};
MirroredFace mirror_half(const HalfFace& half);

/// The margins of the mouth slit from the midline to the corner of the mouth, which is the last of both; empty if there
/// is no slit on the border.
struct LipMargins {
  std::vector<int> upper, lower;
};
LipMargins lip_margins(const HalfFace& half);

}  // namespace facewright
