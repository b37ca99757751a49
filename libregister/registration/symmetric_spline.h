// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libregister/registration/symmetry_plane.h"

namespace facewright {

/// What is known of a displacement field at one place: its component along a direction.
struct SplineDatum {
  Eigen::Vector3d point;      ///< mm
  Eigen::Vector3d direction;  ///< unit length
  double value = 0;           ///< mm
  double stddev = 1;          ///< mm, > 0
};

/// Three data for a displacement known in all components.
void add_displacement(const Eigen::Vector3d& point, const Eigen::Vector3d& displacement, double stddev,
                      std::vector<SplineDatum>* data);

/// Prior of a displacement field: how strongly it varies, and how much of that differs between left and right.
struct SplineSmoothness {
  double amplitude = 2;    ///< mm, > 0: components at points r apart differ by about amplitude * sqrt(2 r / 100 mm)
  double noise = 1;        ///< > 0: factor on the data's stated deviations
  double asymmetry = 0.3;  ///< 0 .. 1: deviation of the antisymmetric part over that of the symmetric one
};

struct SmoothnessOptions {
  double amplitude = 2;           ///< mm: what faces differ by about an average face (docs/registration.md)
  double amplitude_spread = 0.5;  ///< deviation of its logarithm
  double noise_spread = 0.7;      ///< deviation of the logarithm of the factor on stated deviations
};

/// The smoothness that the data themselves make most probable: restricted maximum likelihood of the intrinsic Gaussian
/// process behind the spline [patterson1971, wahba1990], with log-normal priors. plane == nullptr: asymmetry is 1.
/// Cost O(n^3) for each of three asymmetries, n <= some 200 data.
SplineSmoothness estimate_smoothness(const std::vector<SplineDatum>& data, const SymmetryPlane* plane,
                                     const SmoothnessOptions& options = {});

/// Displacement field with kernel -r, affine part free, fitted to data along directions. It is a thin-plate spline
/// [bookstein1989, wahba1990] whose symmetric and antisymmetric parts about a plane are smoothed differently: the two
/// sides of a face tell of each other. Throws InvalidInput if the data do not fix the affine part.
class SymmetricSpline {
 public:
  SymmetricSpline(const std::vector<SplineDatum>& data, const SymmetryPlane* plane, const SplineSmoothness& smoothness);

  /// Displacements at the rows of X, (N x 3) mm. Beyond 1.5 times the data's radius they pass into the affine part.
  Vertices operator()(const Vertices& X) const;

 private:
  Eigen::Matrix<double, 3, Eigen::Dynamic> points_, pulls_, mirrored_points_, mirrored_pulls_;
  Eigen::Matrix<double, 4, 3> affine_;
  Eigen::Vector3d centre_;
  double radius_ = 0;
};

}  // namespace facewright
