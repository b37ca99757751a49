// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: a scan that vertices are matched to.
#pragma once

#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/fitting/fit_scan.h"
#include "libmodel/fitting/point_tree.h"

namespace facewright {

/// The scan's points that belong to a triangle (all, if there are none) with normals, ready to be asked for the
/// nearest. Throws InvalidInput for fewer than 12.
struct ScanSurface {
  ScanSurface(const Mesh& scan, int threads);

  std::vector<int> rows;  ///< of the scan
  Vertices V, N;
  PointTree tree;
  bool oriented;  ///< the normals' signs are known
  std::vector<bool> at_rim;
  double spacing = 0;  ///< median distance between neighbours, mm
};

struct ScanMatches {
  std::vector<ScanMatch> state;
  std::vector<int> point;    ///< of the scan surface, -1: none
  Eigen::VectorXd distance;  ///< along the scan's normal, signed, mm
};

/// Nearest points of the scan within `reach` for vertices V with normals N.
ScanMatches match_to_scan(const ScanSurface& scan, const Vertices& V, const Vertices& N, double reach,
                          double largest_angle_deg, int threads);

/// Leaves out the worst share of the matches; returns the robust standard deviation of all that counted, mm.
double trim(ScanMatches& matches, double share);

}  // namespace facewright
