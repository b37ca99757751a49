// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

namespace facewright {

/// Positions, (N x 3), millimetres. Row-major on purpose: data() is the interleaved 3N vector of the statistics.
using Vertices = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
/// Triangles, (M x 3), 0-based vertex indices, counter-clockwise seen from outside.
using Faces = Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;
/// Linear RGB in 0..1, (N x 3).
using Colours = Vertices;
/// Texture coordinates, (N x 2), in 0..1; v runs up (OBJ convention).
using TexCoords = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;

/// A triangle mesh. Correspondence between meshes is row identity: nothing may reorder rows.
struct Mesh {
  Vertices V;
  Faces F;
  Colours colours;  ///< (N x 3) linear RGB, or empty
  TexCoords uv;     ///< (T x 2) or empty; one row per vertex unless uv_faces is set
  Faces uv_faces;   ///< (M x 3) rows of uv per triangle corner ("wedge" coordinates), or empty: then F indexes uv

  Eigen::Index vertex_count() const { return V.rows(); }
  Eigen::Index face_count() const { return F.rows(); }
  bool has_colours() const { return colours.rows() > 0 && colours.rows() == V.rows(); }
  bool has_uv() const { return uv.rows() > 0; }
};

/// A point on a triangle mesh: triangle index and barycentric coordinates (they sum to 1).
struct SurfacePoint {
  int triangle = -1;
  Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
};

/// Position of a surface point of the mesh (V, F).
inline Eigen::Vector3d position(const SurfacePoint& p, const Vertices& V, const Faces& F) {
  return (p.barycentric[0] * V.row(F(p.triangle, 0)) + p.barycentric[1] * V.row(F(p.triangle, 1)) +
          p.barycentric[2] * V.row(F(p.triangle, 2)))
      .transpose();
}

/// Throws InvalidInput if indices are out of range, positions are not finite, or attribute rows do not match.
void validate(const Mesh& mesh);

}  // namespace facewright
