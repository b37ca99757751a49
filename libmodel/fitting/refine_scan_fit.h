// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/fitting/fit_scan.h"

namespace facewright {

struct RefineOptions {
  double smoothing_mm = 3;  ///< the offsets do not follow what is narrower than about this, > 0
  double fading = 1e-3;     ///< pull back to the model's face against the scan's pull, > 0: where nothing matches
  double largest_distance_mm = 5;  ///< matches beyond do not count, > 0
  double largest_angle_deg = 60;   ///< between the normals of face and scan at a match
  double trimmed = 0.01;           ///< share of the worst matches that are left out, 0..0.9
  int iterations = 10;             ///< rounds of matching and solving at most, >= 1
  double tolerance_mm = 0.01;      ///< stop when vertices move less, root mean square
  int threads = 0;                 ///< 0 = all
};

struct RefineSummary {
  FitStop stop = FitStop::not_run;
  int iterations = 0;
  double last_change_mm = 0;
  int matched = 0;         ///< vertices with a match that counts
  double median_mm = 0;    ///< their distance to the scan, before: FitScanSummary::median_mm
  double mean_offset = 0;  ///< length of the offsets, mm
  RefineOptions options;
};
struct RefinedFace {
  Vertices V;                      ///< (N x 3) fit.fitted + offsets, the scan's frame, mm: no face of the model
  Vertices offsets;                ///< (N x 3) mm, the scan's frame
  Eigen::VectorXd distances;       ///< (N) as FitScanResult's
  std::vector<ScanMatch> matches;  ///< (N)
  RefineSummary summary;
};

/// Non-rigid refinement after fit_scan, for what the model cannot say: free offsets D of all vertices, in turns matched
/// along the scan's normals [besl1992] and
///   argmin sum_i a_i w_i |d_i - t_i|^2 + l^4 sum_i a_i |(Laplacian D)_i|^2 + fading sum_i a_i |d_i|^2,
/// a_i areas, w_i robust weights [welsch1978], t_i the way to the scan. A thin plate over the face; it moves vertices
/// towards the surface, not along it, so that the model decides which vertex is where. Some seconds at 30,000 vertices.
/// Throws InvalidInput for options out of range or a fit of another model.
RefinedFace refine_to_scan(const MorphableModel& model, const Mesh& scan, const FitScanResult& fit,
                           const RefineOptions& options = {});

}  // namespace facewright
