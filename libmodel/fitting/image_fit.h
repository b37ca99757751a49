// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/fitting/fit_landmarks.h"
#include "libmodel/fitting/model_rows.h"
#include "libmodel/fitting/normal_equations.h"

namespace facewright {

/// What all images of a fit have in common.
struct FitContext {
  FitContext(const MorphableModel& model, const FitOptions& options, const LandmarkMapper& mapper);

  const MorphableModel& model;
  const FitOptions& options;
  const LandmarkMapper& mapper;
  bool has_modes = false, has_blendshapes = false;  ///< of expression, in this fit
  ModelRows rows;
  Eigen::VectorXd expression_ridge, expression_lower, expression_upper;  ///< weight of the prior, bounds
  FaceContours contours;

  /// Neutral leading vertices with this shape, kept until another is asked for: the images of a round share it. Not for
  /// several threads at once.
  const Eigen::VectorXd& neutral(const Eigen::VectorXd& shape, Eigen::Index vertices) const;

 private:
  mutable Eigen::VectorXd neutral_shape_, neutral_;
};

/// One image of a fit: its landmarks, pose, expression and outline under a given shape. A round is: linearise, then
/// (add to the normal equations, settle_expression) until the bounds hold, then follow.
class ImageFit {
 public:
  /// Throws InvalidInput if the landmarks cannot determine a pose.
  ImageFit(const FitContext& context, const ImageLandmarks& landmarks);

  /// Normal equations of expression and shape about the current state, the camera taken out.
  void linearise();
  /// Adds those of the shape, the free expression coefficients taken out.
  void add(Eigen::MatrixXd& H, Eigen::VectorXd& g) const;
  /// The best expression for a shape; true if other coefficients are at their bounds than before.
  bool settle_expression(const Eigen::VectorXd& shape);
  /// Pose, outline and weights for a shape and the expression settled; the largest change of an expression
  /// coefficient in this round.
  double follow(const Eigen::VectorXd& shape);
  FitResult result(const Eigen::VectorXd& shape) const;

 private:
  void find_unknown(const ImageLandmarks& landmarks);
  void start_pose();
  void update_pose();
  void update_weights();
  void match_contour();
  double outer_eye_distance() const;
  Eigen::MatrixXd camera_derivative() const;

  const FitContext& context_;
  std::vector<Observation> seen_;
  std::vector<std::string> unknown_;
  LandmarkShapeModel local_;
  Pixels pixels_;
  Eigen::VectorXd shape_, expression_, settled_;
  std::vector<int> free_;  ///< expression coefficients not at a bound
  Vertices X_;             ///< (K x 3) the model's points now
  std::vector<Information> W_;
  std::vector<int> jaw_;                          ///< observations tied to the outline
  std::vector<Eigen::Vector2d> contour_normals_;  ///< of the observations in jaw_, zero without a match
  int contour_rounds_ = 0;
  AffineCamera camera_;
  OrthographicCamera orthographic_;
  double start_condition_ = 0, sigma_px_ = 0;
  WhitenedRows rows_;
  Eigen::MatrixXd G_, K_;        ///< normal equations [camera | shape | expression | r]; those of the free coefficients
  Eigen::Index eliminated_ = 0;  ///< camera parameters in front
};

}  // namespace facewright
