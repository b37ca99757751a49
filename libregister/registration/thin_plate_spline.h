// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

#include "libmodel/core/mesh.h"

namespace facewright {

/// Weight of a spline's bending part at a distance from the middle of its landmarks: 1 within 1.5 radii of these, 0
/// beyond 2.5, once differentiable between. What is left far away is the affine part.
double bend_weight(double distance, double radius);

/// Thin-plate spline in three dimensions, kernel U(r) = -r, affine part free. [bookstein1989]
/// It bends as little as the weighted landmarks allow; lambda = 0 interpolates, large lambda tends to the affine fit.
class ThinPlateSpline {
 public:
  /// Maps the rows of `from` to those of `to`, (K x 3), K >= 4 and not coplanar. lambda >= 0 is dimensionless
  /// (distances are divided by the mean landmark distance); `relative_variance` (K) scales it per landmark, 1 = average
  /// precision. Throws InvalidInput for too few or coplanar points. Cost O(K^3).
  ThinPlateSpline(const Vertices& from, const Vertices& to, double lambda, const Eigen::VectorXd& relative_variance);

  /// Beyond 1.5 times the landmarks' radius the map passes smoothly into its affine part.
  Vertices operator()(const Vertices& X) const;

  /// Leave-one-out residual vectors, (K x 3): what each landmark would miss if it were not used, in closed form.
  /// [rippa1999]
  const Vertices& leave_one_out() const { return leave_one_out_; }
  double lambda() const { return lambda_; }

 private:
  Vertices centres_;
  Eigen::MatrixXd coefficients_;  // (K x 3) kernel part
  Eigen::Matrix<double, 4, 3> affine_;
  Vertices leave_one_out_;
  Eigen::RowVector3d centre_;
  double radius_ = 0, scale_ = 1, lambda_ = 0;
};

/// The smoothest spline, lambda in [1e-4, 10] (16 steps, logarithmic), whose mean squared leave-one-out residual lies
/// within `standard_errors` (>= 0) of the least: faces bend smoothly, landmarks are noisy. [breiman1984] The least
/// itself follows landmark noise: 0.06 mm worse correspondence in our sweep, docs/registration.md.
ThinPlateSpline fit_thin_plate_spline(const Vertices& from, const Vertices& to,
                                      const Eigen::VectorXd& relative_variance, double least_lambda = 1e-4,
                                      double standard_errors = 1);

}  // namespace facewright
