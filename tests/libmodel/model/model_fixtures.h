// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/QR>

#include "libmodel/core/random.h"
#include "libmodel/model/morphable_model.h"

namespace facewright::testing {

inline Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index cols) {
  return Eigen::MatrixXd::NullaryExpr(rows, cols, [&] { return random.normal(); });
}

inline PcaModel random_pca(Random& random, Eigen::Index values, Eigen::Index modes, double scale, double offset = 0) {
  PcaModel model;
  model.mean = Eigen::VectorXd::NullaryExpr(values, [&] { return offset + scale * random.normal(); });
  model.basis = Eigen::HouseholderQR<Eigen::MatrixXd>(random_matrix(random, values, modes)).householderQ() *
                Eigen::MatrixXd::Identity(values, modes);
  model.variances =
      Eigen::VectorXd::NullaryExpr(modes, [&](Eigen::Index k) { return scale * scale * std::pow(0.6, double(k)); });
  return model;
}

// A strip of triangles over `n` vertices.
inline Faces strip(int n) {
  Faces F(n - 2, 3);
  for (int i = 0; i + 2 < n; ++i) F.row(i) << i, i + 1 + i % 2, i + 2 - i % 2;
  return F;
}

// The same either side of a midline edge 0 1: a strip of even vertices, and its mirror image of odd ones. `n` is even.
inline Faces symmetric_strip(int n) {
  const int half = n / 2 - 1;  // triangles per side
  const Faces one = strip(half + 2);
  const auto vertex = [](int i, int side) { return i < 2 ? i : 2 * (i - 1) + side; };
  Faces F(2 * half, 3);
  for (int i = 0; i < half; ++i) {
    F.row(2 * i) << vertex(one(i, 0), 0), vertex(one(i, 1), 0), vertex(one(i, 2), 0);
    F.row(2 * i + 1) << vertex(one(i, 0), 1), vertex(one(i, 2), 1), vertex(one(i, 1), 1);
  }
  return F;
}

/// Three levels of 12, 20 and 40 vertices, colour, expression, landmarks, uv, symmetry, parents.
inline MorphableModelParts random_parts(std::uint64_t seed) {
  Random random(seed);
  MorphableModelParts p;
  p.shape = random_pca(random, 120, 5, 10);
  p.colour = random_pca(random, 120, 4, 0.05, 0.5);
  p.expression = random_pca(random, 120, 2, 1);
  for (int n : {12, 20, 40}) p.levels.push_back({n, symmetric_strip(n)});
  p.uv = TexCoords::NullaryExpr(40, 2, [&] { return random.uniform(); });
  for (int v = 0; v < 40; ++v) p.mirror.push_back(v < 2 ? v : v ^ 1);
  for (int v = 6; v < 40; ++v) p.parents.push_back({v - 2, v - 1, v % 5 == 0 ? v - 3 : -1});
  p.landmarks["31"] = {{0, Eigen::Vector3d::UnitX()}, 0};
  p.landmarks["9"] = {{5, Eigen::Vector3d::UnitX()}, p.levels[0].F(5, 0)};
  p.landmarks["left_ear"] = {{3, Eigen::Vector3d::UnitZ()}, p.levels[0].F(3, 2)};
  for (const char* name : {"jaw_open", "smile"}) {
    p.blendshapes.push_back({name, Eigen::VectorXd::NullaryExpr(120, [&] { return random.normal(); })});
  }
  p.regions["left_contour"] = {1, 15, 33};
  p.regions["lips"] = {3, 4, 11, 19, 20, 39};
  p.provenance = {{"program", "test"}, {"options", "{\"variance_share\": 0.99}"}};
  return p;
}

}  // namespace facewright::testing
