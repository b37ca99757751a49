// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "libmodel/core/image.h"
#include "libmodel/fitting/fit_scan.h"
#include "libmodel/fitting/refine_scan_fit.h"

namespace facewright {

struct FitScanFilesOptions {
  std::filesystem::path model;
  std::filesystem::path scan;       ///< mesh or points (.ply, .obj); empty: only the landmarks are fitted
  std::filesystem::path landmarks;  ///< 3D, in the scan's frame and unit; empty: beside the scan
  std::filesystem::path mapping;    ///< landmark mapping file, or empty
  std::filesystem::path output;     ///< folder to write into
  double mm_per_unit = 0;           ///< of scan and landmarks; 0 = from the size of the face: mm, cm or m
  FitScanOptions fit;
  FitPointsOptions points;        ///< where there is no scan
  bool needs_expression = false;  ///< refuse a model without expression modes
  bool refine = false;            ///< also free offsets after the fit
  RefineOptions refinement;       ///< their options
  double error_range_mm = 2;      ///< distance at which the error picture's colours end, > 0
};

struct FitScanFilesSummary {
  std::string stem;  ///< of the results
  std::filesystem::path landmarks;
  double mm_per_unit = 1;
  std::string units_reason;               ///< how the unit was found, in words
  std::optional<FitScanResult> scan;      ///< fitted to a scan, ...
  std::optional<FitPointsResult> points;  ///< ... or to landmarks alone
  std::optional<RefinedFace> refined;
  double landmark_rms_mm = 0;
};

/// Fits a model to a scan from its landmarks, or to 3D landmarks alone, and writes by the scan's (the landmarks') stem
/// STEM.ply (the fitted face in the scan's frame, millimetres) and STEM.json (coefficients, pose, residuals); for a
/// scan also STEM_distances.csv (per vertex) and STEM_error.png (distances on the face); refined, also
/// STEM_refined.ply, STEM_refined_distances.csv and STEM_refined_error.png. Nothing is left where it fails. Throws
/// InvalidInput for files that do not go together or a unit that makes no face of the model's size, IoError for files.
FitScanFilesSummary fit_scan_files(const FitScanFilesOptions& options);

/// Signed distances on a face in the model's frame, from the left, the front and the right: blue inside the scan, red
/// outside, grey without a match, the colours' range below.
Image distance_picture(const Vertices& V, const Faces& F, const Eigen::VectorXd& distances,
                       const std::vector<ScanMatch>& matches, double range_mm);

}  // namespace facewright
