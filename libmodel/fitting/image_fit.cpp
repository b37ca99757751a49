// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/image_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "libmodel/core/errors.h"
#include "libmodel/fitting/bounded_least_squares.h"
#include "libmodel/fitting/orthographic_camera.h"

namespace facewright {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

std::string list(const std::vector<std::string>& names) {
  std::string text;
  for (size_t i = 0; i < std::min<size_t>(names.size(), 8); ++i) text += (i > 0 ? ", " : "") + names[i];
  return text + (names.size() > 8 ? ", ..." : "");
}

ExpressionMode resolve(ExpressionMode mode, const MorphableModel& model) {
  if (mode == ExpressionMode::blendshapes && model.blendshapes().empty())
    throw InvalidInput("fit: the model has no blendshapes; use another expression mode");
  if (mode == ExpressionMode::modes && !model.expression())
    throw InvalidInput("fit: the model has no expression modes; use another expression mode");
  if (mode != ExpressionMode::automatic) return mode;
  if (!model.blendshapes().empty()) return ExpressionMode::blendshapes;
  return model.expression() ? ExpressionMode::modes : ExpressionMode::none;
}

ModelRows model_rows(const MorphableModel& model, const FitOptions& options) {
  const ExpressionMode mode = resolve(options.expression.mode, model);
  return {model.shape(), options.modes, mode == ExpressionMode::modes ? &*model.expression() : nullptr,
          mode == ExpressionMode::blendshapes ? &model.blendshapes() : nullptr};
}

}  // namespace

FitContext::FitContext(const MorphableModel& model_, const FitOptions& options_, const LandmarkMapper& mapper_)
    : model(model_), options(options_), mapper(mapper_), rows(model_rows(model_, options_)) {
  const ExpressionOptions& e = options.expression;
  const ExpressionMode mode = resolve(e.mode, model);
  has_modes = mode == ExpressionMode::modes;
  has_blendshapes = mode == ExpressionMode::blendshapes;
  const Eigen::Index n = rows.expressions();
  const double sigma = has_blendshapes ? e.blendshape_sigma : 1;
  expression_ridge = Eigen::VectorXd::Constant(n, e.lambda / (sigma * sigma));
  expression_lower = Eigen::VectorXd::Constant(n, has_blendshapes ? e.lower : -infinity);
  expression_upper = Eigen::VectorXd::Constant(n, has_blendshapes ? e.upper : infinity);
  if (options.jaw != JawMode::contour) return;
  contours = model.contours(options.contour.level);
}

const Eigen::VectorXd& FitContext::neutral(const Eigen::VectorXd& shape, Eigen::Index vertices) const {
  if (neutral_.size() != 3 * vertices || neutral_shape_.size() != shape.size() || neutral_shape_ != shape) {
    neutral_ = model.shape().instance(shape, vertices);
    neutral_shape_ = shape;
  }
  return neutral_;
}

ImageFit::ImageFit(const FitContext& context, const ImageLandmarks& landmarks)
    : context_(context), seen_(observations(landmarks, context.model, context.mapper)) {
  find_unknown(landmarks);
  if (seen_.size() < 4)
    throw InvalidInput("fit: expected at least 4 landmarks that the model has, got " + std::to_string(seen_.size()) +
                       " of " + std::to_string(landmarks.size()) +
                       (unknown_.empty() ? "" : " (unknown: " + list(unknown_) + ")") +
                       "; check the landmark names against the model's");
  const auto K = static_cast<Eigen::Index>(seen_.size());
  pixels_.resize(K, 2);
  context.rows.resize(local_, K);
  for (Eigen::Index k = 0; k < K; ++k) {
    const Observation& o = seen_[static_cast<size_t>(k)];
    pixels_.row(k) = o.pixel.transpose();
    context.rows.put(local_, k, o.vertex);
    if (context.options.jaw == JawMode::contour && o.jaw_place > 0) jaw_.push_back(static_cast<int>(k));
  }
  contour_normals_.assign(jaw_.size(), Eigen::Vector2d::Zero());
  shape_ = Eigen::VectorXd::Zero(context.rows.shape_modes());
  expression_ = Eigen::VectorXd::Zero(context.rows.expressions())
                    .cwiseMax(context.expression_lower)
                    .cwiseMin(context.expression_upper);
  settled_ = expression_;
  free_.resize(context.has_modes ? static_cast<size_t>(expression_.size()) : 0);
  std::iota(free_.begin(), free_.end(), 0);
  start_pose();
}

void ImageFit::find_unknown(const ImageLandmarks& landmarks) {
  size_t k = 0;  // seen_ is in the order of the landmarks
  for (const auto& [name, mark] : landmarks)
    if (k < seen_.size() && seen_[k].name == name)
      ++k;
    else
      unknown_.push_back(name);
}

/// The first camera, from the points that do not slide.
void ImageFit::start_pose() {
  X_ = local_.points((Eigen::VectorXd(shape_.size() + expression_.size()) << shape_, expression_).finished());
  const JawMode jaw = context_.options.jaw;
  std::vector<Eigen::Index> rows;
  for (size_t k = 0; k < seen_.size(); ++k)
    if (seen_[k].jaw_place == 0 || jaw == JawMode::fixed || (seen_[k].jaw_place == 9 && jaw != JawMode::contour))
      rows.push_back(static_cast<Eigen::Index>(k));
  const AffineCameraResult start = estimate_affine_camera(X_(rows, Eigen::all), pixels_(rows, Eigen::all));
  start_condition_ = start.summary.condition;
  camera_ = start.camera;
  orthographic_ = nearest_orthographic(camera_);
  update_pose();
}

Eigen::MatrixXd ImageFit::camera_derivative() const {
  return context_.options.camera == CameraKind::orthographic ? pixel_derivative(orthographic_, X_)
                                                             : pixel_derivative(X_);
}

void ImageFit::linearise() {
  const Eigen::MatrixXd nuisance = camera_derivative();
  whiten(rows_, local_, seen_, camera_, W_, nuisance);
  gram(G_, rows_);
  eliminated_ = nuisance.cols();
  eliminate(G_, eliminated_);
}

void ImageFit::add(Eigen::MatrixXd& H, Eigen::VectorXd& g) const {
  const Eigen::Index M = shape_.size(), E = expression_.size(), p = eliminated_, last = G_.rows() - 1;
  H.triangularView<Eigen::Lower>() += G_.block(p, p, M, M);
  g += G_.row(last).segment(p, M).transpose();
  if (E == 0) return;
  // [expression x shape] and what the coefficients at their bounds leave of the right hand sides
  const auto C = G_.block(p + M, p, E, M);
  const Eigen::MatrixXd S = G_.block(p + M, p + M, E, E).selfadjointView<Eigen::Lower>();
  Eigen::VectorXd bound = settled_;
  bound(free_).setZero();
  g -= C.transpose() * bound;
  if (free_.empty()) return;
  const Eigen::VectorXd rest = G_.row(last).segment(p + M, E).transpose() - S * bound;
  Eigen::MatrixXd K = S(free_, free_);
  K.diagonal() += context_.expression_ridge(free_);
  const Eigen::LDLT<Eigen::MatrixXd> solver(K);
  const Eigen::MatrixXd C_free = C(free_, Eigen::all), KC = solver.solve(C_free);
  H.triangularView<Eigen::Lower>() -= C_free.transpose() * KC;
  g -= KC.transpose() * rest(free_);
}

bool ImageFit::settle_expression(const Eigen::VectorXd& shape) {
  const Eigen::Index M = shape_.size(), E = expression_.size(), p = eliminated_;
  if (E == 0) return false;
  Eigen::MatrixXd S = G_.block(p + M, p + M, E, E);
  S.diagonal() += context_.expression_ridge;
  const Eigen::VectorXd g = G_.row(G_.rows() - 1).segment(p + M, E).transpose() - G_.block(p + M, p, E, M) * shape;
  BoundedLeastSquaresResult best = minimise_bounded(S, g, context_.expression_lower, context_.expression_upper);
  settled_ = std::move(best.x);
  const bool changed = free_ != best.free;
  free_ = std::move(best.free);
  return changed;
}

double ImageFit::follow(const Eigen::VectorXd& shape) {
  const double sigma = context_.has_blendshapes ? context_.options.expression.blendshape_sigma : 1;
  const double change = settled_.size() > 0 ? (settled_ - expression_).cwiseAbs().maxCoeff() / sigma : 0;
  shape_ = shape;
  expression_ = settled_;
  const Eigen::VectorXd all = (Eigen::VectorXd(shape_.size() + expression_.size()) << shape_, expression_).finished();
  X_ = local_.points(all);
  update_pose();
  return change;
}

void ImageFit::update_pose() {
  update_weights();
  if (context_.options.camera == CameraKind::orthographic) {
    orthographic_ = refine_orthographic(orthographic_, X_, pixels_, W_, {3, 1e-8}).camera;  // the next round goes on
    camera_ = orthographic_.affine();
  } else {
    std::vector<Eigen::Index> rows;
    for (size_t k = 0; k < seen_.size(); ++k)
      if (determines_point(W_[k])) rows.push_back(static_cast<Eigen::Index>(k));
    camera_ = estimate_affine_camera(X_(rows, Eigen::all), pixels_(rows, Eigen::all)).camera;
    orthographic_ = nearest_orthographic(camera_);
  }
  if (!jaw_.empty() && contour_rounds_ < context_.options.contour.rounds) match_contour();
  update_weights();
}

void ImageFit::update_weights() {
  const FitOptions& options = context_.options;
  ObservationNoise noise;
  noise.sigma_px = sigma_px_ = options.sigma_px > 0 ? options.sigma_px : options.sigma_mm * orthographic_.s;
  noise.jaw_factor = options.jaw_factor;
  noise.jaw = options.jaw;
  const Pixels projected = (X_ * camera_.A.transpose()).rowwise() + camera_.b.transpose();
  W_ = informations(seen_, projected, head_pose(orthographic_.R).yaw, noise);
  for (size_t j = 0; j < jaw_.size(); ++j) {
    const auto k = static_cast<size_t>(jaw_[j]);
    const double sigma = noise.jaw_factor * (seen_[k].sigma_px > 0 ? seen_[k].sigma_px : sigma_px_);
    W_[k] = contour_normals_[j] * contour_normals_[j].transpose() / (sigma * sigma);
  }
}

void ImageFit::match_contour() {
  ++contour_rounds_;
  const ContourOptions& options = context_.options.contour;
  const Faces& F = context_.model.faces(options.level);
  const bool is_mean = shape_.isZero(0);  // as in the first round, for nothing
  const Eigen::VectorXd& neutral =
      context_.neutral(is_mean ? Eigen::VectorXd() : shape_, context_.model.vertex_count(options.level));
  const Vertices V = context_.rows.with_expression(neutral, expression_);
  const OutlineSearch search{pixels_(jaw_, Eigen::all), options.largest_distance * orthographic_.s};
  const auto outline = jaw_outline(V, F, context_.contours, camera_, options, search);
  const std::vector<int> match = match_outline(search.landmarks, outline, search.reach_px);
  for (size_t j = 0; j < jaw_.size(); ++j) {
    contour_normals_[j].setZero();
    if (match[j] < 0) continue;
    const OutlinePoint& point = outline[static_cast<size_t>(match[j])];
    contour_normals_[j] = point.normal;
    seen_[static_cast<size_t>(jaw_[j])].vertex = point.vertex;
    context_.rows.put(local_, jaw_[j], point.vertex);
    X_.row(jaw_[j]) = V.row(point.vertex);
  }
}

double ImageFit::outer_eye_distance() const {
  const auto find = [&](const char* name) {
    return std::find_if(seen_.begin(), seen_.end(), [&](const Observation& o) { return o.name == name; });
  };
  const auto right = find("37"), left = find("46");
  return right == seen_.end() || left == seen_.end() ? 0 : (right->pixel - left->pixel).norm();
}

FitResult ImageFit::result(const Eigen::VectorXd& shape) const {
  FitResult out;
  out.camera = camera_;
  out.orthographic = orthographic_;
  out.pose = head_pose(orthographic_.R);
  out.shape_coefficients = shape;
  if (context_.has_modes) out.expression_coefficients = expression_;
  for (Eigen::Index i = 0; context_.has_blendshapes && i < expression_.size(); ++i)
    out.blendshape_weights[context_.model.blendshapes()[static_cast<size_t>(i)].name] = expression_[i];
  FitSummary& summary = out.summary;
  double sum = 0;
  int count = 0;
  for (size_t k = 0; k < seen_.size(); ++k) {
    const Eigen::Vector2d fitted = camera_.project(X_.row(static_cast<Eigen::Index>(k)).transpose());
    summary.residuals.push_back({seen_[k].name, seen_[k].vertex, seen_[k].pixel, fitted, !W_[k].isZero(0)});
    if (!determines_point(W_[k])) continue;  // ignored, or free to slide
    sum += (seen_[k].pixel - fitted).squaredNorm();
    ++count;
  }
  summary.rms_px = std::sqrt(sum / std::max(count, 1));
  summary.outer_eye_distance_px = outer_eye_distance();
  if (summary.outer_eye_distance_px > 0) summary.rms_percent = 100 * summary.rms_px / summary.outer_eye_distance_px;
  summary.log_prior = -0.5 * (shape.squaredNorm() + out.expression_coefficients.squaredNorm());
  summary.start_condition = start_condition_;
  summary.sigma_px = sigma_px_;
  summary.unknown = unknown_;
  summary.options = context_.options;
  return out;
}

}  // namespace facewright
