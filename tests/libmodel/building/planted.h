// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Geometry>
#include <Eigen/QR>

#include "libmodel/core/multires_template.h"
#include "libmodel/core/random.h"
#include "libmodel/core/registered_set.h"
#include "libmodel/core/similarity.h"

namespace facewright::testing {

inline Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index cols) {
  return Eigen::MatrixXd::NullaryExpr(rows, cols, [&] { return random.normal(); });
}

inline Eigen::MatrixXd random_orthonormal(Random& random, Eigen::Index rows, Eigen::Index cols) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(random_matrix(random, rows, cols));
  return qr.householderQ() * Eigen::MatrixXd::Identity(rows, cols);
}

/// Samples mean + basis * diag(stddev) * c with c normal.
struct PlantedGaussian {
  Eigen::RowVectorXd mean;
  Eigen::MatrixXd basis;
  Eigen::VectorXd stddev;
  SampleMatrix samples;
};

inline PlantedGaussian planted_gaussian(Random& random, Eigen::Index samples, Eigen::Index values, Eigen::Index modes) {
  PlantedGaussian p;
  p.mean = 50 * random_matrix(random, 1, values);
  p.basis = random_orthonormal(random, values, modes);
  p.stddev = Eigen::VectorXd::NullaryExpr(modes, [](Eigen::Index k) { return 40 * std::pow(0.8, double(k)); });
  p.samples = random_matrix(random, samples, modes) * p.stddev.asDiagonal() * p.basis.transpose();
  p.samples.rowwise() += p.mean;
  return p;
}

inline Similarity random_motion(Random& random) {
  Similarity motion;
  motion.R = Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal())
                 .normalized()
                 .toRotationMatrix();
  motion.t = 200 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
  return motion;
}

/// A rectangular grid over x and y with a bulge, m x m vertices, mirrored left to right, two levels: the whole grid is
/// level 1; level 0 has no triangles of its own but the first vertices.
inline MultiresTemplate grid_template(int m) {
  MultiresTemplate t;
  t.V.resize(m * m, 3);
  t.mirror.resize(static_cast<size_t>(m * m));
  for (int j = 0; j < m; ++j)
    for (int i = 0; i < m; ++i) {
      const double x = 10.0 * (i - 0.5 * (m - 1)), y = 10.0 * (j - 0.5 * (m - 1));
      t.V.row(j * m + i) << x, y, 40 - 0.01 * x * x - 0.005 * y * y;
      t.mirror[static_cast<size_t>(j * m + i)] = j * m + (m - 1 - i);
    }
  const auto grid = [m](int rows) {
    Faces F(2 * (m - 1) * (rows - 1), 3);
    int f = 0;
    for (int j = 0; j + 1 < rows; ++j)
      for (int i = 0; i + 1 < m; ++i) {
        const int v = j * m + i;
        F.row(f++) << v, v + 1, v + m + 1;
        F.row(f++) << v, v + m + 1, v + m;
      }
    return F;
  };
  t.levels = {{m * (m / 2), grid(m / 2)}, {m * m, grid(m)}};
  t.landmarks["31"] = {{0, Eigen::Vector3d(0.2, 0.7, 0.1)}, -1};
  t.landmarks["9"] = {{0, Eigen::Vector3d::UnitX()}, 0};
  for (int v = m * (m / 2); v < m * m; ++v) t.parents.push_back({v - m, v - 1, -1});
  return t;
}

}  // namespace facewright::testing
