// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "tests/libmodel/fitting/toy_model.h"

#include <Eigen/QR>
#include <cmath>
#include <numbers>

#include "libmodel/core/random.h"

namespace facewright {
namespace {

constexpr int columns = 25, rows = 31;

Vertices base_shape() {
  Vertices V(columns * rows, 3);
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const double x = -70 + 140.0 * i / (columns - 1), y = 90 - 180.0 * j / (rows - 1);
      const double dome = 90 * std::sqrt(std::max(0.05, 1 - 0.7 * x * x / 4900 - 0.5 * y * y / 8100)) - 60;
      const double nose = 22 * std::exp(-(x * x / 120 + (y + 8) * (y + 8) / 260));
      V.row(j * columns + i) << x, y, dome + nose;
    }
  return V;
}

Faces grid_faces() {
  Faces F(2 * (columns - 1) * (rows - 1), 3);
  for (int j = 0, f = 0; j + 1 < rows; ++j)
    for (int i = 0; i + 1 < columns; ++i, f += 2) {
      const int a = j * columns + i, below = a + columns;
      F.row(f) << a, below, below + 1;
      F.row(f + 1) << a, below + 1, a + 1;
    }
  return F;
}

int nearest_vertex(const Vertices& V, double x, double y) {
  Eigen::Index at = 0;
  (V.leftCols<2>().rowwise() - Eigen::RowVector2d(x, y)).rowwise().squaredNorm().minCoeff(&at);
  return static_cast<int>(at);
}

LandmarkSet marks(const Vertices& V) {
  LandmarkSet set;
  const auto add = [&](int name, double x, double y) { set[std::to_string(name)].vertex = nearest_vertex(V, x, y); };
  for (int k = 1; k <= 17; ++k) {
    const double a = std::numbers::pi * (k - 1) / 16;
    add(k, -64 * std::cos(a), -80 * std::sin(a));
  }
  for (int k = 0; k < 5; ++k) add(18 + k, -52 + 9 * k, 48), add(23 + k, 16 + 9 * k, 48);
  for (int k = 0; k < 4; ++k) add(28 + k, 0, 28 - 12 * k);
  for (int k = 0; k < 5; ++k) add(32 + k, -12 + 6 * k, -20);
  for (int k = 0; k < 6; ++k) {
    const double a = std::numbers::pi * (1 + k / 3.0);
    add(37 + k, -30 + 15 * std::cos(a), 26 - 8 * std::sin(a)), add(43 + k, 30 + 15 * std::cos(a), 26 - 8 * std::sin(a));
  }
  set["46"].vertex = nearest_vertex(V, 46, 26);
  for (int k = 0; k < 20; ++k) {
    const double a = 2 * std::numbers::pi * k / 20;
    add(49 + k, -24 * std::cos(a), -48 + 10 * std::sin(a));
  }
  return set;
}

/// Smooth fields of a few millimetres, made orthonormal with their own variances.
PcaModel shape_model(const Vertices& V, int modes) {
  Random random(42);
  Eigen::MatrixXd fields(3 * V.rows(), modes);
  for (int m = 0; m < modes; ++m) {
    const auto wave = [&] {
      const double kx = random.normal() / 60, ky = random.normal() / 60, phase = random.uniform(0, 6.3);
      return Eigen::VectorXd(((kx * V.col(0) + ky * V.col(1)).array() + phase).sin().matrix());
    };
    Vertices field(V.rows(), 3);
    for (int k = 0; k < 3; ++k) field.col(k) = wave();
    fields.col(m) = as_vector(field);
  }
  PcaModel model;
  model.mean = as_vector(V);
  model.basis =
      Eigen::HouseholderQR<Eigen::MatrixXd>(fields).householderQ() * Eigen::MatrixXd::Identity(3 * V.rows(), modes);
  model.variances = Eigen::VectorXd::LinSpaced(modes, 16.0, 4.0) * static_cast<double>(V.rows());
  return model;
}

}  // namespace

MorphableModel toy_model(int modes) {
  MorphableModelParts parts;
  const Vertices V = base_shape();
  parts.shape = shape_model(V, modes);
  Colours colours(V.rows(), 3);
  parts.uv.resize(V.rows(), 2);
  for (Eigen::Index i = 0; i < V.rows(); ++i) {
    colours.row(i) << 0.45 + 0.2 * std::sin(V(i, 0) / 15), 0.4 + 0.2 * std::cos(V(i, 1) / 20), 0.3;
    parts.uv.row(i) << 0.5 + V(i, 0) / 150, 0.5 + V(i, 1) / 190;
  }
  parts.colour.mean = as_vector(colours);
  parts.colour.basis.resize(colours.size(), 0);
  parts.levels = {{static_cast<int>(V.rows()), grid_faces()}};
  parts.landmarks = marks(V);
  return MorphableModel(std::move(parts));
}

ImageLandmarks project_landmarks(const MorphableModel& model, const Vertices& V, const AffineCamera& camera) {
  ImageLandmarks out;
  for (const auto& [name, mark] : model.landmarks())
    out[name].position = camera.project(V.row(mark.vertex).transpose());
  return out;
}

}  // namespace facewright
