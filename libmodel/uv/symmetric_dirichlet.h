// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

#include "libmodel/core/mesh.h"

namespace facewright {

// Private to this module.

/// A triangle laid into its own plane, corners (0, 0), (x1, 0), (x2, y2), and its weight in the energy.
struct RestTriangle {
  double x1 = 1, x2 = 0, y2 = 1, weight = 1;
  double area() const { return 0.5 * x1 * y2; }
};

/// The triangle with edges e1, e2 from its first corner (mm); one with less than `least_area` (mm^2) has no shape worth
/// keeping and becomes equilateral with that area.
RestTriangle rest_triangle(const Eigen::Vector3d& e1, const Eigen::Vector3d& e2, double least_area);

/// (s1^2 + s2^2 + 1/s1^2 + 1/s2^2) / 4 - 1 of the map from the rest triangle to the corners (rows of `corners`): 0 for
/// an isometry, infinite for a flipped triangle. [smith2015]
double symmetric_dirichlet(const RestTriangle& t, const Eigen::Matrix<double, 3, 2>& corners);

struct DirichletTerms {
  Eigen::Matrix<double, 6, 1> gradient;  ///< by (a_u, a_v, b_u, b_v, c_u, c_v)
  Eigen::Matrix<double, 6, 6> hessian;   ///< its negative curvature set to zero
};
DirichletTerms symmetric_dirichlet_terms(const RestTriangle& t, const Eigen::Matrix<double, 3, 2>& corners);

}  // namespace facewright
