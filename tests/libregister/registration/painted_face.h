// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cmath>
#include <functional>

#include "tests/libregister/registration/bumpy_face.h"

namespace facewright {

/// Linear RGB at the place (x, y) of the bumpy face.
using Paint = std::function<Eigen::RowVector3d(double x, double y)>;

inline double blob(double x, double y, double width) { return std::exp(-0.5 * (x * x + y * y) / (width * width)); }

inline Eigen::RowVector3d plain_skin(double, double) { return {0.47, 0.27, 0.19}; }

/// `amount` 0 .. 1 of dark red on the skin.
inline Eigen::RowVector3d marked_skin(double amount) {
  return (1 - amount) * plain_skin(0, 0) + amount * Eigen::RowVector3d(0.12, 0.035, 0.03);
}

/// Four spots, well inside the face and off the slopes of its nose.
inline Eigen::RowVector3d spots(double x, double y) {
  return marked_skin(blob(x - 35, y - 5, 5) + blob(x + 30, y - 40, 5) + blob(x + 35, y + 35, 5) +
                     blob(x - 25, y + 45, 5));
}

/// A stripe along y from border to border.
inline Eigen::RowVector3d stripe(double x, double) { return marked_skin(blob(x - 35, 0, 5)); }

inline Colours painted(const Vertices& V, const Paint& paint) {
  Colours c(V.rows(), 3);
  for (Eigen::Index i = 0; i < V.rows(); ++i) c.row(i) = paint(V(i, 0), V(i, 1));
  return c;
}

}  // namespace facewright
