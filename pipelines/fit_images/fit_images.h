// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "libmodel/core/progress.h"
#include "libmodel/fitting/fit_model.h"

namespace facewright {

/// Finds the landmarks of the face in an image; may be called by several threads at once. Throws InvalidInput if there
/// is none.
using LandmarkFinder = std::function<ImageLandmarks(const Image&)>;

struct FitImagesOptions {
  std::filesystem::path model;
  std::vector<std::filesystem::path> images;     ///< see list_images; stems differ
  std::vector<std::filesystem::path> landmarks;  ///< one per image, or empty: .pts, .json or .ljson beside each image
  std::filesystem::path mapping;                 ///< landmark mapping file, or empty
  std::filesystem::path output;                  ///< folder to write into
  FitModelOptions fit;
  bool perspective = false;                  ///< a pinhole camera (fit_landmarks_perspective) instead of fit.fit.camera
  double focal_px = 0;                       ///< its focal length, pixels; 0 = unknown: estimated
  std::optional<Eigen::Vector2d> principal;  ///< its principal point, pixels; none: the image's centre
  bool glb = true;                           ///< write STEM.glb beside STEM.obj
  bool page = true;                          ///< write STEM.html, the fit to look at
  int jobs = 0;                              ///< images fitted at once, 0 = all cores; does not change a byte
  LandmarkFinder finder;                     ///< for images without a landmark file; may be empty
};

struct FittedImage {
  std::filesystem::path image, landmarks;  ///< landmarks empty: found in the image
  bool fitted = false;
  std::string reason;  ///< why not, and what to do
  FitResult fit;
  std::optional<PerspectiveFitResult> perspective;  ///< then `fit` is empty
};

/// What every fit of an image tells, whatever its camera.
struct FitNumbers {
  HeadPose pose;                                                               ///< radians
  Eigen::VectorXd shape_coefficients, shape_stddevs, expression_coefficients;  ///< standard deviations
  std::map<std::string, double> blendshape_weights;
  FitStop stop = FitStop::not_run;
  int iterations = 0;
  double last_change = 0, rms_px = 0, rms_percent = 0, outer_eye_distance_px = 0, sigma_px = 0, lambda = 0;
  double pixels_per_mm = 0;  ///< at the face
  std::vector<LandmarkResidual> residuals;
  std::vector<std::string> unknown;
};
FitNumbers fit_numbers(const FittedImage& image);

struct FitImagesSummary {
  std::vector<FittedImage> images;  ///< in the order of the options
  int fitted = 0, failed = 0;
  bool textured = false;  ///< the model has texture coordinates
};

/// Fits a model to images and writes for each, by its stem: STEM.obj with STEM.mtl, STEM.glb, STEM_isomap.png (what
/// was seen, by its alpha), STEM_texture.png (completed) with STEM_sources.png (what of it was seen, mirrored or
/// modelled), STEM_frontal.png, STEM_overlay.png, STEM.json (pose, coefficients, residuals), STEM.html (all of it to
/// look at); and fits.csv, a line per image. An image that cannot be fitted ends in problematic/STEM.txt, the others go
/// on. Throws InvalidInput if none can be fitted, for options that do not go together, IoError if the model cannot be
/// read or the output not written.
FitImagesSummary fit_images(const FitImagesOptions& options, const Progress& progress = {});

}  // namespace facewright
