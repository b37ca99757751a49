// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

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

/// A round sheet of `rings` rings of 6, 12, 18, ... vertices: map(r, a) with r in 0..1 and a the angle from +y towards
/// +x; mirrored left-right.
inline Sheet round_sheet(int rings, const std::function<Eigen::Vector3d(double, double)>& map) {
  const auto first = [](int k) { return k == 0 ? 0 : 1 + 3 * k * (k - 1); };
  const auto index = [&](int k, int i) { return k == 0 ? 0 : first(k) + (i + 6 * k) % (6 * k); };
  Sheet sheet;
  sheet.V.resize(first(rings + 1), 3);
  sheet.plane.resize(first(rings + 1), 2);
  std::vector<Eigen::RowVector3i> faces;
  for (int k = 0; k <= rings; ++k)
    for (int i = 0; i < std::max(1, 6 * k); ++i) {
      const double r = static_cast<double>(k) / rings, a = k == 0 ? 0 : std::numbers::pi * i / (3 * k);
      sheet.V.row(index(k, i)) = map(r, a);
      sheet.plane.row(index(k, i)) << r * std::sin(a), r * std::cos(a);
      sheet.mirror.push_back(index(k, -i));
    }
  for (int k = 1; k <= rings; ++k)
    for (int side = 0; side < 6; ++side)
      for (int j = 0; j < k; ++j) {
        const int outer = index(k, side * k + j), next = index(k, side * k + j + 1);
        const int inner = index(k - 1, side * (k - 1) + j);
        faces.emplace_back(outer, inner, next);
        if (j + 1 < k) faces.emplace_back(next, inner, index(k - 1, side * (k - 1) + j + 1));
      }
  sheet.F.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (size_t f = 0; f < faces.size(); ++f) sheet.F.row(static_cast<Eigen::Index>(f)) = faces[f];
  return sheet;
}

/// The sheet without the vertices that `drop` names and their triangles; no symmetry table.
inline Sheet without_vertices(const Sheet& s, const std::function<bool(int)>& drop) {
  Sheet kept = s;
  kept.mirror.clear();
  std::vector<int> row(static_cast<size_t>(s.V.rows()), -1);
  int n = 0;
  for (int v = 0; v < s.V.rows(); ++v) {
    if (drop(v)) continue;
    kept.V.row(n) = s.V.row(v);
    kept.plane.row(n) = s.plane.row(v);
    row[static_cast<size_t>(v)] = n++;
  }
  kept.V.conservativeResize(n, 3);
  kept.plane.conservativeResize(n, 2);
  kept.F = without(s.F, [&](int f) { return drop(s.F(f, 0)) || drop(s.F(f, 1)) || drop(s.F(f, 2)); });
  for (Eigen::Index i = 0; i < kept.F.size(); ++i) kept.F.data()[i] = row[static_cast<size_t>(kept.F.data()[i])];
  return kept;
}

/// An m x k grid sheet cut open along its row j between the columns i1 and i2 (kept joined); the new upper vertices
/// are lifted by `gap` along y. 0: they lie on the lower ones.
inline Sheet with_slit(const Sheet& s, int m, int j, int i1, int i2, double gap) {
  Sheet cut = s;
  for (int i = i1 + 1; i < i2; ++i) {
    const int v = j * m + i, copy = static_cast<int>(cut.V.rows());
    cut.V.conservativeResize(copy + 1, 3);
    cut.V.row(copy) = s.V.row(v) + Eigen::RowVector3d(0, gap, 0);
    cut.plane.conservativeResize(copy + 1, 2);
    cut.plane.row(copy) = s.plane.row(v);
    cut.mirror.push_back(static_cast<int>(s.V.rows()) + (m - 1 - i) - i1 - 1);
    for (Eigen::Index f = 0; f < s.F.rows(); ++f)
      if (s.F.row(f).maxCoeff() > j * m + m - 1)  // a triangle above the row
        for (int k = 0; k < 3; ++k)
          if (s.F(f, k) == v) cut.F(f, k) = copy;
  }
  return cut;
}

}  // namespace facewright::testing
