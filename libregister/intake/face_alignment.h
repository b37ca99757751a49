// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: the reference face laid onto a scan, coarsely.
#pragma once

#include <vector>

#include "libmodel/core/similarity.h"
#include "libmodel/surface/nearest.h"
#include "libregister/intake/surface_sample.h"

namespace facewright {

struct FaceAlignment {
  Similarity scan_from_face;                        ///< its scale is the mean of the three below
  Eigen::Vector3d sides = Eigen::Vector3d::Ones();  ///< this face's width, height and depth over the reference's
  double misfit = 0;         ///< mm: mean of |distance to the surface| over the inner face, each at most 8 mm
  double relief = 0;         ///< correlation of the inner face's depths with the scan's, quadrics taken off, -1..1
  double bend = 0;           ///< mean over the inner face of 1 - |cosine| between its normals and the scan's, 0..1
  double cover = 0;          ///< share of the inner face's points with the scan's surface beside them, 0..1
  std::vector<int> partner;  ///< per point of the face: the sample of the scan it lies on, -1: none
  std::vector<Eigen::Vector3d> normal;  ///< per point of the face: its outward unit normal, in the scan's axes
};

/// Points of a reference face with outward normals; the inner face is eyes, nose and mouth.
struct FacePoints {
  SurfaceSample sample;
  std::vector<bool> inner;
};

/// Lays the face onto the scan from a pose near the right one: point to plane along the face's own normals, points far
/// away left out; width, height and depth are free, held near 1 by what is known of people. `index` is over scan.P;
/// millimetres.
FaceAlignment align_face(const FacePoints& face, const SurfaceSample& scan, const PointIndex& index,
                         const Similarity& scan_from_face, int iterations = 30);

}  // namespace facewright
