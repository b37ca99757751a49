// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

// The parts of the mean head and the curves its features, landmarks and colours share. Internal to the module.
// All distances are of mirrored points: x means |x|.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace facewright::mean_head {

using Eigen::Vector3d;

inline double square(double x) { return x * x; }
inline double gauss(double x) { return std::exp(-x * x); }
/// 0 below lo, 1 above hi, C1 between; lo > hi reverses it.
inline double smooth_step(double lo, double hi, double x) {
  const double t = std::clamp((x - lo) / (hi - lo), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}
/// Smooth union and its complement: blends over about k millimetres.
inline double smooth_min(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * k / 4;
}
inline double smooth_max(double a, double b, double k) { return -smooth_min(-a, -b, k); }

/// Approximate distance to an axis-aligned ellipsoid: exact gradient length near its surface.
inline double ellipsoid(const Vector3d& p, const Vector3d& centre, const Vector3d& radii) {
  const Vector3d q = (p - centre).cwiseQuotient(radii);
  const double k0 = q.norm(), k1 = q.cwiseQuotient(radii).norm();
  return k1 < 1e-9 ? -radii.minCoeff() : k0 * (k0 - 1) / k1;
}

/// Capsule with a radius that runs linearly from ra at a to rb at b.
inline double tapered_capsule(const Vector3d& p, const Vector3d& a, const Vector3d& b, double ra, double rb) {
  const Vector3d d = b - a;
  const double t = std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0);
  return (p - a - t * d).norm() - (ra + t * (rb - ra));
}

// --- eyes ---
inline const Vector3d eye_centre{31.3, 0.0, 31.6};
inline constexpr double eye_radius = 12.2, lid_radius = 13.6;
inline constexpr double en_x = 15.9, ex_x = 44.6;  // inner and outer eye corner: en-en 31.8, ex-ex 89.2
/// Straight line from corner to corner, and the lid margins above and below it, at x.
double canthal_line(double x);
double upper_lid(double x);
double lower_lid(double x);
double lid_crease(double x);
/// < 0 inside the eye opening (frontal projection, mm, approximate distance).
double eye_opening(double x, double y);

// --- mouth ---
inline constexpr double mouth_half_width = 25.6;
double lip_seam(double x);
double upper_vermilion(double x);
double lower_vermilion(double x);

// --- brow: its centre line (y at x) and half thickness ---
inline constexpr double brow_inner_x = 9.5, brow_outer_x = 53;
double brow_line(double x);
double brow_half_thickness(double x);

/// The head without nose, lips, lids and ears: skull, cheeks, jaw and neck.
double base_distance(const Vector3d& p);
double add_lids(double d, const Vector3d& p);
double add_eyes(double d, const Vector3d& p);
double add_nose(double d, const Vector3d& p);
double add_mouth(double d, const Vector3d& p);
double add_ear(double d, const Vector3d& p);
/// The outer ear alone, without its root.
double ear_distance(const Vector3d& p);

}  // namespace facewright::mean_head
