// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <functional>

#include "libmodel/core/mesh.h"

namespace facewright::testing {

struct Sheet {
  Vertices V;
  Faces F;
  std::vector<int> mirror;
  TexCoords plane;  // the parameters, a..b each
};

/// An m x k grid of the parameters (s, t) in [-1, 1]^2 mapped to space; mirrored in s, with diagonals that mirror too.
inline Sheet sheet(int m, int k, const std::function<Eigen::Vector3d(double, double)>& map) {
  Sheet sheet;
  sheet.V.resize(m * k, 3);
  sheet.plane.resize(m * k, 2);
  for (int j = 0; j < k; ++j)
    for (int i = 0; i < m; ++i) {
      const double s = -1 + 2.0 * i / (m - 1), t = -1 + 2.0 * j / (k - 1);
      sheet.V.row(j * m + i) = map(s, t);
      sheet.plane.row(j * m + i) << s, t;
      sheet.mirror.push_back(j * m + m - 1 - i);
    }
  sheet.F.resize(2 * (m - 1) * (k - 1), 3);
  int f = 0;
  for (int j = 0; j + 1 < k; ++j)
    for (int i = 0; i + 1 < m; ++i) {
      const int v = j * m + i;
      if (2 * i + 1 < m - 1) {
        sheet.F.row(f++) << v, v + 1, v + m + 1;
        sheet.F.row(f++) << v, v + m + 1, v + m;
      } else {
        sheet.F.row(f++) << v, v + 1, v + m;
        sheet.F.row(f++) << v + 1, v + m + 1, v + m;
      }
    }
  return sheet;
}

/// The sheet without the triangles that `drop` names; vertices are kept, so drop only a slit's triangles.
inline Faces without(const Faces& F, const std::function<bool(int)>& drop) {
  Faces kept(F.rows(), 3);
  Eigen::Index count = 0;
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    if (!drop(static_cast<int>(f))) kept.row(count++) = F.row(f);
  return kept.topRows(count);
}

}  // namespace facewright::testing
