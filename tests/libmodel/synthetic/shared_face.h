// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Geometry>

#include "libmodel/synthetic/scan_person.h"

namespace facewright {

/// One parametric face for all tests of a program; a coarser mesh than the default, which is enough for its properties.
inline const ParametricFace& shared_face() {
  static const ParametricFace face(CanonicalMeshOptions{1.6, 4.5, 0});
  return face;
}

inline Eigen::Vector3d row(const Vertices& V, Eigen::Index i) { return V.row(i).transpose(); }

inline Eigen::Vector3d facet_normal(const Vertices& V, const Faces& F, Eigen::Index f) {
  return (row(V, F(f, 1)) - row(V, F(f, 0))).cross(row(V, F(f, 2)) - row(V, F(f, 0)));
}

/// A scanner without any fault, looking straight ahead.
inline ScannerOptions perfect_scanner() {
  ScannerOptions o;
  o.noise = o.spikes = o.pose_deg = o.landmark_noise = 0;
  o.holes = 0;
  return o;
}

}  // namespace facewright
