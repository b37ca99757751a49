// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "tests/libmodel/model/model_fixtures.h"

namespace facewright::testing {

/// A model with the size and the outward triangles of a face: the front of an ellipsoid 140 x 200 x 90 mm with a nose,
/// 13 x 17 vertices, 4 shape, 2 expression and 3 colour modes, two blendshapes, texture coordinates, a landmark.
inline MorphableModelParts face_sheet_parts(std::uint64_t seed) {
  constexpr int kColumns = 13, kRows = 17, kCount = kColumns * kRows;
  Random random(seed);
  MorphableModelParts p;
  p.shape = random_pca(random, 3 * kCount, 4, 40);
  p.expression = random_pca(random, 3 * kCount, 2, 10);
  p.colour = random_pca(random, 3 * kCount, 3, 0.2, 0.5);
  p.expression->mean *= 0.1;
  p.colour.mean = p.colour.mean.cwiseMax(0.2).cwiseMin(0.8);
  p.uv.resize(kCount, 2);
  Vertices V(kCount, 3);
  Faces F(2 * (kColumns - 1) * (kRows - 1), 3);
  Eigen::Index f = 0;
  for (int r = 0; r < kRows; ++r)
    for (int c = 0; c < kColumns; ++c) {
      const double s = 2.0 * c / (kColumns - 1) - 1, t = 2.0 * r / (kRows - 1) - 1;
      const int v = r * kColumns + c;
      V.row(v) << 70 * s, 100 * t,
          90 * std::sqrt(std::max(0.0, 1 - 0.45 * (s * s + t * t))) + 20 * std::exp(-30 * (s * s + t * t));
      p.uv.row(v) << 0.05 + 0.45 * (s + 1), 0.05 + 0.45 * (t + 1);
      if (r + 1 == kRows || c + 1 == kColumns) continue;
      F.row(f++) << v, v + 1, v + kColumns;
      F.row(f++) << v + 1, v + kColumns + 1, v + kColumns;
    }
  p.shape.mean = as_vector(V);
  p.blendshapes = {{"smile", 2 * p.shape.basis.col(1)}, {"jaw open", -3 * p.shape.basis.col(2)}};
  p.levels = {{kCount, F}};
  const int nose = kCount / 2;
  for (Eigen::Index i = 0; i < F.rows(); ++i)
    if (F(i, 0) == nose) p.landmarks["31"] = {{static_cast<int>(i), Eigen::Vector3d::UnitX()}, nose};
  return p;
}

}  // namespace facewright::testing
