// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"
#include "libmodel/core/similarity.h"
#include "libregister/registration/symmetric_spline.h"

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
  double landmark_stddev = 1.0;  ///< mm, over the three axes, where a landmark states none
  SmoothnessOptions smoothness;  ///< priors of the symmetric spline
  /// >= 1: how much less landmarks on the curves of jaw, brows, lids and lips are trusted along their curve than across
  /// it, ends of curves excepted. 1: they do not slide (docs/registration.md). [gunz2005]
  double slide = 1;
  int least_for_spline = 6;  ///< below this many landmarks the map stays a similarity
  /// Below this many the thin-plate spline with lambda >= 1 serves: its smoothness cannot be told from the data.
  int least_for_smoothness = 12;
};

struct GlobalMapResult {
  Vertices V;  ///< the reference in the scan's place, (N x 3)
  AlignResult alignment;
  std::vector<std::string> dropped;  ///< landmarks left out by the leave-one-out test
  double leave_one_out_rms = 0;      ///< mm: how well a landmark is foretold by the others
  double landmark_noise = 0;         ///< mm: deviation of the landmarks, found from themselves; 0: not estimated
  bool used_spline = false;
  /// Of the symmetric spline, in the reference's frame; no data: another map was used.
  std::vector<SplineDatum> data;
  SplineSmoothness smoothness;
};

/// Landmark-driven global mapping of the reference vertices (N x 3) onto a scan: similarity, then a spline without the
/// landmarks that the others contradict. [tena2006] names the stage; the splines are our choice: with twelve landmarks
/// or more the symmetric one, with six or more a thin-plate spline. plane: of the reference, nullptr if it has none.
GlobalMapResult global_mapping(const Vertices& reference, const SymmetryPlane* plane,
                               const Landmarks& reference_landmarks, const Landmarks& scan_landmarks,
                               const GlobalMapOptions& options = {}, const AlignOptions& align = {});

/// The symmetric spline of `map` fitted again with further data in the reference's frame; X (N x 3) reference
/// positions.
Vertices map_with_data(const GlobalMapResult& map, const SymmetryPlane* plane, const std::vector<SplineDatum>& further,
                       const Vertices& X);

}  // namespace facewright
