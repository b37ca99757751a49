// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/fit_landmarks.h"

#include <algorithm>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/fitting/fit_shape.h"
#include "libmodel/fitting/orthographic_camera.h"

namespace facewright {
namespace {

void check(const FitOptions& o) {
  const auto expect = [](bool ok, const char* what) {
    if (!ok) throw InvalidInput(std::string("fit options: expected ") + what);
  };
  expect(o.lambda >= 0, "lambda >= 0");
  expect(o.sigma_px >= 0, "sigma_px >= 0 (0 = automatic)");
  expect(o.sigma_mm > 0, "sigma_mm > 0");
  expect(o.jaw_factor >= 1, "jaw_factor >= 1");
  expect(o.iterations >= 1, "iterations >= 1");
  expect(o.tolerance >= 0, "tolerance >= 0");
}

std::string list(const std::vector<std::string>& names) {
  std::string text;
  for (size_t i = 0; i < std::min<size_t>(names.size(), 8); ++i) text += (i > 0 ? ", " : "") + names[i];
  return text + (names.size() > 8 ? ", ..." : "");
}

/// State of one fit; each step is one line of the algorithm.
class LandmarkFit {
 public:
  LandmarkFit(const MorphableModel& model, const ImageLandmarks& landmarks, const FitOptions& options,
              const LandmarkMapper& mapper)
      : options_(options), seen_(observations(landmarks, model, mapper)) {
    check(options);
    for (const auto& [name, mark] : landmarks)
      if (std::none_of(seen_.begin(), seen_.end(), [&, &n = name](const Observation& o) { return o.name == n; }))
        result_.summary.unknown.push_back(name);
    if (seen_.size() < 4)
      throw InvalidInput("fit: expected at least 4 landmarks that the model has, got " + std::to_string(seen_.size()) +
                         " of " + std::to_string(landmarks.size()) +
                         (result_.summary.unknown.empty() ? "" : " (unknown: " + list(result_.summary.unknown) + ")") +
                         "; check the landmark names against the model's");
    const PcaModel* expression = model.expression() ? &*model.expression() : nullptr;
    local_ = landmark_shape_model(seen_, model.shape(), options.modes, expression);
    expression_modes_ = expression ? expression->mode_count() : 0;
    pixels_.resize(static_cast<Eigen::Index>(seen_.size()), 2);
    for (size_t k = 0; k < seen_.size(); ++k) pixels_.row(static_cast<Eigen::Index>(k)) = seen_[k].pixel.transpose();
  }

  FitResult run() {
    Eigen::VectorXd c = Eigen::VectorXd::Zero(local_.basis.cols());
    FitSummary& summary = result_.summary;
    start_pose(local_.points(c));
    summary.stop = FitStop::iteration_limit;
    while (summary.iterations < options_.iterations) {
      const Eigen::VectorXd next =
          fit_shape(local_, seen_, result_.camera, W_, options_.lambda, camera_derivative(local_.points(c)));
      summary.last_change = next.size() > 0 ? (next - c).cwiseAbs().maxCoeff() : 0;
      c = next;
      update_pose(local_.points(c));
      ++summary.iterations;
      if (summary.last_change > options_.tolerance) continue;
      summary.stop = FitStop::converged;
      break;
    }
    finish(c);
    return std::move(result_);
  }

 private:
  /// The first camera, from the points that do not slide.
  void start_pose(const Vertices& X) {
    std::vector<Eigen::Index> rows;
    for (size_t k = 0; k < seen_.size(); ++k)
      if (seen_[k].jaw_place == 0 || seen_[k].jaw_place == 9 || options_.jaw == JawMode::fixed)
        rows.push_back(static_cast<Eigen::Index>(k));
    const AffineCameraResult start = estimate_affine_camera(X(rows, Eigen::all), pixels_(rows, Eigen::all));
    result_.summary.start_condition = start.summary.condition;
    result_.camera = start.camera;
    result_.orthographic = nearest_orthographic(start.camera);
    update_pose(X);
  }

  /// The shape step lets the camera follow to first order: plain turns take hundreds of rounds where a mode of the
  /// shape looks like a turn of the head.
  Eigen::MatrixXd camera_derivative(const Vertices& X) const {
    return options_.camera == CameraKind::orthographic ? pixel_derivative(result_.orthographic, X)
                                                       : pixel_derivative(X);
  }

  void update_pose(const Vertices& X) {
    update_weights(X);
    if (options_.camera == CameraKind::orthographic) {
      result_.orthographic = refine_orthographic(result_.orthographic, X, pixels_, W_).camera;
      result_.camera = result_.orthographic.affine();
    } else {
      std::vector<Eigen::Index> rows;
      for (size_t k = 0; k < seen_.size(); ++k)
        if (determines_point(W_[k])) rows.push_back(static_cast<Eigen::Index>(k));
      result_.camera = estimate_affine_camera(X(rows, Eigen::all), pixels_(rows, Eigen::all)).camera;
      result_.orthographic = nearest_orthographic(result_.camera);
    }
    result_.pose = head_pose(result_.orthographic.R);
    update_weights(X);
  }

  void update_weights(const Vertices& X) {
    ObservationNoise noise;
    noise.sigma_px = options_.sigma_px > 0 ? options_.sigma_px : options_.sigma_mm * result_.orthographic.s;
    noise.jaw_factor = options_.jaw_factor;
    noise.jaw = options_.jaw;
    result_.summary.sigma_px = noise.sigma_px;
    W_ = informations(seen_, projected(X), head_pose(result_.orthographic.R).yaw, noise);
  }

  Pixels projected(const Vertices& X) const {
    return (X * result_.camera.A.transpose()).rowwise() + result_.camera.b.transpose();
  }

  void finish(const Eigen::VectorXd& c) {
    FitSummary& summary = result_.summary;
    result_.shape_coefficients = c.head(c.size() - expression_modes_);
    result_.expression_coefficients = c.tail(expression_modes_);
    const Pixels fitted = projected(local_.points(c));
    double sum = 0;
    int count = 0;
    for (size_t k = 0; k < seen_.size(); ++k) {
      const bool used = !W_[k].isZero(0);
      summary.residuals.push_back(
          {seen_[k].name, seen_[k].vertex, seen_[k].pixel, fitted.row(static_cast<Eigen::Index>(k)).transpose(), used});
      if (!determines_point(W_[k])) continue;  // ignored, or free to slide
      sum += (summary.residuals.back().measured - summary.residuals.back().fitted).squaredNorm();
      ++count;
    }
    summary.rms_px = std::sqrt(sum / std::max(count, 1));
    summary.outer_eye_distance_px = outer_eye_distance();
    if (summary.outer_eye_distance_px > 0) summary.rms_percent = 100 * summary.rms_px / summary.outer_eye_distance_px;
    summary.options = options_;
  }

  double outer_eye_distance() const {
    const auto find = [&](const char* name) {
      return std::find_if(seen_.begin(), seen_.end(), [&](const Observation& o) { return o.name == name; });
    };
    const auto right = find("37"), left = find("46");
    return right == seen_.end() || left == seen_.end() ? 0 : (right->pixel - left->pixel).norm();
  }

  FitOptions options_;
  std::vector<Observation> seen_;
  LandmarkShapeModel local_;
  Eigen::Index expression_modes_ = 0;
  Pixels pixels_;
  std::vector<Information> W_;
  FitResult result_;
};

}  // namespace

std::string to_string(FitStop stop) {
  switch (stop) {
    case FitStop::not_run:
      return "not run";
    case FitStop::converged:
      return "converged";
    case FitStop::iteration_limit:
      return "iteration limit";
  }
  return "unknown";
}

FitResult fit_landmarks(const MorphableModel& model, const ImageLandmarks& landmarks, const FitOptions& options,
                        const LandmarkMapper& mapper) {
  return LandmarkFit(model, landmarks, options, mapper).run();
}

}  // namespace facewright
