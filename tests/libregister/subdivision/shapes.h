// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/core/random.h"

namespace facewright::test {

/// A mesh and its left-right table.
struct SymmetricMesh {
  Mesh mesh;
  std::vector<int> mirror;
};

/// Mirror-symmetric annulus in the plane: a (2n x m) grid of cells, x from -n to n, every cell cut by a diagonal that
/// leans towards the midline, with a slit (a missing cell pair) in the middle.
inline SymmetricMesh annulus(int n, int m, double depth = 0) {
  SymmetricMesh s;
  const int columns = 2 * n + 1;
  const auto id = [&](int i, int j) { return (i + n) + columns * j; };
  s.mesh.V.resize(columns * (m + 1), 3);
  s.mirror.resize(static_cast<size_t>(columns) * (m + 1));
  for (int j = 0; j <= m; ++j)
    for (int i = -n; i <= n; ++i) {
      s.mesh.V.row(id(i, j)) << i, 1.1 * j + 0.02 * i * i, depth * std::cos(0.5 * i) * std::cos(0.3 * j);
      s.mirror[id(i, j)] = id(-i, j);
    }
  std::vector<Eigen::Vector3i> faces;
  for (int j = 0; j < m; ++j)
    for (int i = -n; i < n; ++i) {
      if (j == m / 2 && (i == 0 || i == -1)) continue;
      const int a = id(i, j), b = id(i + 1, j), c = id(i + 1, j + 1), d = id(i, j + 1);
      if (i >= 0) {
        faces.push_back({a, b, c});
        faces.push_back({a, c, d});
      } else {
        faces.push_back({a, b, d});
        faces.push_back({b, c, d});
      }
    }
  s.mesh.F.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (size_t f = 0; f < faces.size(); ++f) s.mesh.F.row(static_cast<Eigen::Index>(f)) = faces[f];
  return s;
}

/// The annulus with random heights, still symmetric: its greedy pairing leaves singles and pairs across the midline.
inline SymmetricMesh crooked_annulus(int n, int m, double height = 1) {
  SymmetricMesh s = annulus(n, m);
  Random random(3);
  for (size_t v = 0; v < s.mirror.size(); ++v)
    if (static_cast<int>(v) <= s.mirror[v]) {
      const double z = height * random.normal();
      s.mesh.V(static_cast<Eigen::Index>(v), 2) = s.mesh.V(s.mirror[v], 2) = z;
    }
  return s;
}

inline Mesh octahedron() {
  Mesh o;
  o.V.resize(6, 3);
  o.V << 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1;
  o.F.resize(8, 3);
  o.F << 0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5;
  return o;
}

}  // namespace facewright::test
