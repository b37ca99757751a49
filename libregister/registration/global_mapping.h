// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"
#include "libmodel/core/similarity.h"

namespace facewright {

struct AlignOptions {
  double inlier_distance =
      12;  ///< mm after scaling, > 0; twice the spread of faces about a similarity (measured 4-6 mm)
  double lowest_scale = 0.75;   ///< scan size over reference size; adult faces lie well inside
  double highest_scale = 1.35;  ///< the same, upper end
  double least_inliers = 0.6;   ///< share of landmarks that must agree, 0..1
};

/// A robust similarity of reference landmarks onto a scan's.
struct AlignResult {
  Similarity scan_from_reference;
  std::vector<std::string> used;      ///< names that agree
  std::vector<std::string> rejected;  ///< names farther off than the robust bound: probably wrong
  bool swapped_left_right = false;    ///< the scan's labels were mirrored; `landmarks` has them put right
  Landmarks landmarks;                ///< the scan's landmarks as used
  double rms = 0;                     ///< mm, over `used`
};

/// RANSAC over landmark triples (all of them up to 20,000), then Tukey-weighted refinement. Landmarks without a
/// namesake in the reference are ignored. Throws InvalidInput with fewer than 3 in common, when the scale lies outside
/// the allowed range, or when too few agree: the scan is then no face, or its landmarks are wrong.
AlignResult align_landmarks(const Landmarks& reference, const Landmarks& scan, const AlignOptions& options = {});

struct GlobalMapOptions {
  double outlier_distance = 8;   ///< mm, leave-one-out residual from which a landmark may be dropped
  double outlier_factor = 5;     ///< ... and this many robust deviations above the median
  double highest_dropped = 0.2;  ///< share of landmarks that may be dropped, 0..1
  /// Least smoothing of the spline for landmarks of 1 mm deviation, >= 0; goes with the mean square of stated
  /// deviations. What leave-one-out residuals cannot tell: they are ruled by what faces do between landmarks
  /// (docs/registration.md).
  double least_lambda = 0.4;
  int least_for_spline = 6;        ///< below this many landmarks the map stays a similarity
  int least_for_free_lambda = 12;  ///< below this many, lambda >= 1 (leave-one-out is unreliable)
};

struct GlobalMapResult {
  Vertices V;  ///< the reference in the scan's place, (N x 3)
  AlignResult alignment;
  std::vector<std::string> dropped;  ///< landmarks left out by the leave-one-out test
  double lambda = 0;                 ///< chosen smoothing, 0 if no spline was used
  double leave_one_out_rms = 0;      ///< mm: how well a landmark is foretold by the others
  double residual_rms = 0;           ///< mm, at the landmarks used
  bool used_spline = false;
};

/// Landmark-driven global mapping of the reference vertices (N x 3) onto a scan: similarity, then thin-plate spline
/// whose smoothing is chosen by leave-one-out and which drops landmarks that the others contradict. [tena2006] names
/// the stage; the spline is our choice.
GlobalMapResult global_mapping(const Vertices& reference, const Landmarks& reference_landmarks,
                               const Landmarks& scan_landmarks, const GlobalMapOptions& options = {},
                               const AlignOptions& align = {});

}  // namespace facewright
