// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libmodel/core/landmarks.h"

namespace facewright {

/// A Gaussian-windowed affine displacement shift + linear (p - centre), mirrored to the other side unless its centre is
/// on the midline. A ramp, if set, multiplies the window: 0 above y = ramp_from, 1 below ramp_to (mm).
struct WarpWindow {
  Eigen::Vector3d centre, radius;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  Eigen::Matrix3d linear = Eigen::Matrix3d::Zero();
  double ramp_from = 0, ramp_to = 0;

  Eigen::Vector3d displacement(const Eigen::Vector3d& p) const;
};

/// One dimension in which people differ. The windows are scaled so that one standard deviation of the parameter changes
/// `measure` (a signed coordinate difference of two landmarks of the mean head) by `stddev` millimetres.
struct ShapeParameter {
  std::string name;
  std::vector<WarpWindow> windows;
  std::string from, to;  ///< the measure: (to - from) along `axis`; empty = the windows are taken as they are
  int axis = 0;
  double stddev = 0;  ///< mm, published where the measure is a classical one [farkas1994], else chosen by eye
  double size = 0, dimorphism = 0, adiposity = 0;  ///< loadings on the factors people share, -1 .. 1

  Eigen::Vector3d displacement(const Eigen::Vector3d& p) const;
};

/// The parameters of the parametric face, calibrated on the given mean landmarks.
std::vector<ShapeParameter> shape_parameters(const Landmarks& mean_landmarks);

}  // namespace facewright
