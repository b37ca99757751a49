// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cmath>

#include "libmodel/core/landmarks.h"
#include "libmodel/core/multires_template.h"
#include "libmodel/core/topology.h"
#include "libmodel/geometry/normals.h"
#include "tests/support/shapes.h"

namespace facewright {

/// A face-sized analytic surface z(x, y), symmetric in x: a dome with a nose, eye hollows and a chin.
inline double bumpy_face_height(double x, double y) {
  const auto bump = [&](double cx, double cy, double width, double height) {
    const double r2 = ((std::abs(x) - cx) * (std::abs(x) - cx) + (y - cy) * (y - cy)) / (width * width);
    return height * std::exp(-r2);
  };
  return -0.006 * x * x - 0.003 * y * y + bump(0, 0, 12, 20) - bump(32, 30, 14, 6) + bump(0, -60, 16, 6) +
         bump(40, -10, 25, 5);
}

/// A grid of columns x rows vertices over 130 x 170 mm, lifted to the surface.
inline Mesh bumpy_face(int columns, int rows) {
  Mesh m = plane_grid(columns, rows, 130, 170);
  const Eigen::RowVector3d centre = 0.5 * (m.V.colwise().maxCoeff() + m.V.colwise().minCoeff());
  m.V.rowwise() -= centre;
  for (Eigen::Index i = 0; i < m.V.rows(); ++i) m.V(i, 2) = bumpy_face_height(m.V(i, 0), m.V(i, 1));
  return m;
}

/// A template of one level from a mesh whose vertices mirror in x; landmarks on a 5 x 5 lattice of vertices.
inline MultiresTemplate bumpy_template(int columns, int rows) {
  MultiresTemplate t;
  const Mesh m = bumpy_face(columns, rows);
  t.V = m.V;
  t.levels = {{static_cast<int>(m.V.rows()), m.F}};
  t.mirror.assign(static_cast<size_t>(m.V.rows()), -1);
  for (int i = 0; i < m.V.rows(); ++i)
    for (int j = 0; j < m.V.rows(); ++j)
      if (std::abs(m.V(i, 0) + m.V(j, 0)) < 1e-9 && std::abs(m.V(i, 1) - m.V(j, 1)) < 1e-9)
        t.mirror[static_cast<size_t>(i)] = j;
  int name = 1;
  for (const double y : {-70.0, -40.0, 0.0, 30.0, 70.0})
    for (const double x : {-50.0, -25.0, 0.0, 25.0, 50.0}) {
      Eigen::Index nearest;
      (m.V.leftCols<2>().rowwise() - Eigen::RowVector2d(x, y)).rowwise().squaredNorm().minCoeff(&nearest);
      MeshLandmark mark;
      mark.vertex = static_cast<int>(nearest);
      t.landmarks["p" + std::to_string(name++)] = mark;
    }
  return t;
}

/// A smooth deformation of some millimetres, without symmetry.
inline Vertices warped(const Vertices& V, double amplitude = 4) {
  Vertices W = V;
  for (Eigen::Index i = 0; i < V.rows(); ++i) {
    const double x = V(i, 0), y = V(i, 1);
    W(i, 0) += amplitude * std::sin(0.03 * y + 0.4) + 0.05 * x;
    W(i, 1) += amplitude * std::cos(0.025 * x - 0.2);
    W(i, 2) += amplitude * std::sin(0.03 * x + 0.02 * y);
  }
  return W;
}

/// Noise along the normals, sigma in millimetres.
inline Vertices noisy(const Mesh& m, double sigma, std::uint64_t seed) {
  Random random(seed);
  const Vertices N = vertex_normals(m.V, m.F);
  Vertices V = m.V;
  for (Eigen::Index i = 0; i < V.rows(); ++i) V.row(i) += sigma * random.normal() * N.row(i);
  return V;
}

}  // namespace facewright
