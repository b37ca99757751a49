// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "libmodel/fitting/contour.h"
#include "libmodel/fitting/observations.h"
#include "libmodel/render/head_pose.h"

namespace facewright {

enum class CameraKind {
  orthographic,  ///< rotation, scale, shift: more accurate shapes
  affine         ///< the Gold Standard camera as it is [huber2016]
};

enum class ExpressionMode {
  automatic,    ///< blendshapes if the model has any, else its expression modes if it has any
  none,         ///< neutral
  blendshapes,  ///< bounded weights of the model's named blendshapes
  modes         ///< the model's PCA of expressions
};

struct ExpressionOptions {
  ExpressionMode mode = ExpressionMode::automatic;
  double lambda = 1;            ///< weight of the prior on expressions, apart from that on shapes; 1 = calibrated
  double blendshape_sigma = 1;  ///< standard deviation of a blendshape's weight about 0, > 0
  double lower = 0, upper = 1;  ///< bounds of the weights
};

struct FitOptions {
  double lambda = 1;      ///< weight of the prior; 1 = calibrated, 0 = none [aldrian2013]
  double sigma_px = 0;    ///< standard deviation of a landmark in pixels; 0 = sigma_mm times the camera's scale
  double sigma_mm = 1.5;  ///< the same on the face, whatever the image's size; swept, see docs/fitting.md
  double jaw_factor = 2;  ///< jaw landmarks are that much less certain, >= 1
  JawMode jaw = JawMode::slide;
  CameraKind camera = CameraKind::orthographic;
  int iterations = 50;      ///< rounds of pose and shape at most, >= 1
  double tolerance = 1e-3;  ///< stop when no coefficient moves more, standard deviations
  int modes = -1;           ///< shape modes to use, -1 = all
  ExpressionOptions expression;
  ContourOptions contour;  ///< for JawMode::contour
};

enum class FitStop { not_run, converged, iteration_limit };
std::string to_string(FitStop stop);

struct LandmarkResidual {
  std::string name;
  int vertex = -1;
  Eigen::Vector2d measured, fitted;  ///< pixels
  bool used = true;                  ///< false: had no weight (a hidden jaw point, or one without a match)
};

struct FitSummary {
  FitStop stop = FitStop::not_run;
  int iterations = 0;
  double last_change = 0;  ///< largest change of a coefficient in the last round, standard deviations
  double rms_px = 0;       ///< over the landmarks used, jaw points left out unless they are fixed
  double rms_percent = 0;  ///< the same in percent of the outer eye distance in the image; 0 if that is unknown
  double outer_eye_distance_px = 0;  ///< between landmarks 37 and 46; 0 if either is missing
  double start_condition = 0;        ///< of the first pose, see AffineCameraSummary
  double sigma_px = 0;               ///< the standard deviation in use
  std::vector<LandmarkResidual> residuals;
  std::vector<std::string> unknown;  ///< landmarks the model does not have
  double log_prior = 0;              ///< -1/2 of the squared lengths of all coefficients: read it beside rms_px
  FitOptions options;
};

struct FitResult {
  AffineCamera camera;
  OrthographicCamera orthographic;                              ///< the same camera, or the nearest to it
  HeadPose pose;                                                ///< of the orthographic camera, radians
  Eigen::VectorXd shape_coefficients, expression_coefficients;  ///< standard deviations
  std::map<std::string, double> blendshape_weights;             ///< by name, within their bounds
  /// (M x M) posterior covariance of the shape coefficients, pose and expression unknown (to first order).
  Eigen::MatrixXd shape_covariance;
  FitSummary summary;

  Eigen::VectorXd shape_stddevs() const;  ///< (M) square roots of its diagonal
};

/// Fits pose and shape (and expression, if the model has one) to 2D landmarks, in turns until neither moves: Gold
/// Standard camera, refinement, closed-form MAP shape [huber2016] [aldrian2013], the camera (and the expression)
/// following each shape step to first order, which converges in a few rounds where plain turns take hundreds.
/// Expressions start from neutral; blendshape weights are bounded least squares [lawson1974]. The result moves with the
/// image and does not depend on its scale unless sigma_px is set. Throws InvalidInput when fewer than 4 landmarks are
/// known to the model, or they lie in a plane. Under a millisecond for 68 landmarks and 60 modes.
FitResult fit_landmarks(const MorphableModel& model, const ImageLandmarks& landmarks, const FitOptions& options = {},
                        const LandmarkMapper& mapper = {});

/// The fitted face with its expression, colours and texture coordinates, at a level of the model.
Mesh fitted_mesh(const MorphableModel& model, const FitResult& fit, int level = -1);

struct MultiFitSummary {
  FitStop stop = FitStop::not_run;
  int iterations = 0;
  double last_change = 0;  ///< as in FitSummary
  int used_images = 0;
  std::map<size_t, std::string> failed;  ///< images that could not be used, and why
};
struct MultiFitResult {
  Eigen::VectorXd shape_coefficients;  ///< of the person, standard deviations
  Eigen::MatrixXd shape_covariance;    ///< see FitResult
  std::vector<FitResult> images;  ///< pose and expression of each image with the common shape; stop = not_run if failed
  MultiFitSummary summary;
};

/// The same for several images or video frames of one person: a shape in common, from the sum of the images' normal
/// equations, and for each image its own pose, expression and outline. Cost and memory are linear in the images. Images
/// that cannot be used are left out and listed; throws InvalidInput if none can. With one image: fit_landmarks.
MultiFitResult fit_landmarks_multi(const MorphableModel& model, const std::vector<ImageLandmarks>& images,
                                   const FitOptions& options = {}, const LandmarkMapper& mapper = {});

}  // namespace facewright
