// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

#include "libmodel/fitting/fit_points.h"

namespace facewright {

struct FitScanOptions {
  double lambda = 1;       ///< weight of the prior; 1 = calibrated
  double sigma_mm = 2;     ///< standard deviation of scan and model at one place, > 0; swept, see docs/fitting.md
  int independent = 2000;  ///< so many places of the face tell something of their own; errors of neighbours are alike
  double slide = 0.02;     ///< weight along the surface against that across it, 0..1: keeps vertices from drifting
  double landmark_sigma_mm = 1;     ///< of the landmarks without deviations of their own
  double largest_distance_mm = 20;  ///< matches beyond do not count in the first round; halved per round, down to 5
  double largest_angle_deg = 60;    ///< between the normals of model and scan at a match
  double trimmed = 0.05;            ///< share of the worst matches that are left out, 0..0.9
  int iterations = 30;              ///< rounds per level at most, >= 1
  double tolerance = 0.01;          ///< a level ends when no coefficient moves more, standard deviations
  int level = -1;                   ///< finest model level whose vertices are matched, -1 = all
  int modes = -1;                   ///< shape modes to use, -1 = all
  bool expression = true;           ///< use the model's expression modes if it has any
  Scaling scaling = Scaling::fixed;
  int threads = 0;  ///< 0 = all
};

struct ScanLevelSummary {
  int vertices = 0;
  FitStop stop = FitStop::not_run;
  int iterations = 0;
  double last_change = 0;  ///< standard deviations
};
struct FitScanSummary {
  FitStop stop = FitStop::not_run;  ///< of the last level
  std::vector<ScanLevelSummary> levels;
  int vertices = 0;       ///< of the model, last level
  int matched = 0;        ///< of them with a match that counts
  int beyond = 0;         ///< without one: nothing of the scan near, ...
  int at_rim = 0;         ///< ... beside a border or hole of the scan, ...
  int turned = 0;         ///< ... normals do not agree, ...
  int trimmed = 0;        ///< ... among the worst
  double median_mm = 0;   ///< distance of the matched vertices to the scan, along its normals
  double spacing_mm = 0;  ///< median distance between neighbouring points of the scan
  FitScanOptions options;
};
/// What became of a vertex's match to the scan.
enum class ScanMatch : char {
  counts,
  beyond,  ///< nothing of the scan near
  at_rim,  ///< beside a border or hole of the scan
  turned,  ///< normals do not agree
  trimmed  ///< among the worst
};
std::string to_string(ScanMatch match);

struct FitScanResult {
  Similarity scan_from_model;                                   ///< rigid unless scaling is free
  Eigen::VectorXd shape_coefficients, expression_coefficients;  ///< standard deviations
  Eigen::VectorXd coefficient_stddevs;  ///< posterior, of shape and expression, the pose unknown
  Vertices fitted;                      ///< (N x 3) vertices of the finest level, mm, the scan's frame
  Eigen::VectorXd distances;            ///< (N) of them from the scan, along its normals, + outside, mm; see matches
  std::vector<ScanMatch> matches;       ///< (N) whether the distance means anything: counts; none is trimmed
  FitScanSummary summary;
};

/// Fits pose and shape to a scan in millimetres - a mesh, or points alone (F empty) -: model vertices are matched to
/// the nearest points of the scan [besl1992], distances count across its surface [chen1992], with robust weights
/// [welsch1978]; matches at borders and holes, against the normals or among the worst do not count. Coarse levels
/// first. From landmarks (3 at least; they count to the end: along cheeks and forehead a surface alone lets vertices
/// slide) or from a pose. Moves with the scan. Throws InvalidInput for a scan without points, not finite, or with fewer
/// than 3 known landmarks; SolverError if hardly anything of it lies near the face.
FitScanResult fit_scan(const MorphableModel& model, const Mesh& scan, const Landmarks& landmarks,
                       const FitScanOptions& options = {}, const LandmarkMapper& mapper = {});
FitScanResult fit_scan(const MorphableModel& model, const Mesh& scan, const Similarity& scan_from_model,
                       const FitScanOptions& options = {});

}  // namespace facewright
