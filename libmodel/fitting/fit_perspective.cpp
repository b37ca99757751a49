// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/fit_perspective.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/fitting/bounded_least_squares.h"
#include "libmodel/fitting/fit_shape.h"
#include "libmodel/fitting/image_fit.h"

namespace facewright {
namespace {

void check(const FitOptions& o) {
  const auto expect = [](bool ok, const char* what) {
    if (!ok) throw InvalidInput(std::string("perspective fit: expected ") + what);
  };
  expect(o.lambda >= 0, "lambda >= 0");
  expect(o.sigma_px >= 0, "sigma_px >= 0 (0 = automatic)");
  expect(o.sigma_mm > 0, "sigma_mm > 0");
  expect(o.jaw_factor >= 1, "jaw_factor >= 1");
  expect(o.iterations >= 1, "iterations >= 1");
  expect(o.jaw != JawMode::contour,
         "jaw exclude, slide or fixed: outlines are matched under orthographic cameras only");
}

/// State of one fit; each step is one line of the algorithm.
class PerspectiveFit {
 public:
  PerspectiveFit(const MorphableModel& model, const ImageLandmarks& landmarks, const PerspectiveFitOptions& options,
                 const LandmarkMapper& mapper)
      : options_((check(options.fit), options)),
        context_(model, options_.fit, mapper),
        seen_(observations(landmarks, model, mapper)),
        focal_is_free_(options.camera.focal_px <= 0) {
    for (const auto& [name, mark] : landmarks)
      if (std::none_of(seen_.begin(), seen_.end(), [&, &n = name](const Observation& o) { return o.name == n; }))
        result_.summary.unknown.push_back(name);
    if (seen_.size() < 4)
      throw InvalidInput("perspective fit: expected at least 4 landmarks that the model has, got " +
                         std::to_string(seen_.size()) + " of " + std::to_string(landmarks.size()) +
                         "; check the landmark names against the model's");
    const auto K = static_cast<Eigen::Index>(seen_.size());
    pixels_.resize(K, 2);
    context_.rows.resize(local_, K);
    for (Eigen::Index k = 0; k < K; ++k) {
      pixels_.row(k) = seen_[static_cast<size_t>(k)].pixel.transpose();
      context_.rows.put(local_, k, seen_[static_cast<size_t>(k)].vertex);
    }
    ridge_.resize(local_.basis.cols());
    ridge_ << Eigen::VectorXd::Constant(context_.rows.shape_modes(), options.fit.lambda), context_.expression_ridge;
  }

  PerspectiveFitResult run() {
    Eigen::VectorXd c = Eigen::VectorXd::Zero(local_.basis.cols());
    c.tail(context_.rows.expressions()) = Eigen::VectorXd::Zero(context_.rows.expressions())
                                              .cwiseMax(context_.expression_lower)
                                              .cwiseMin(context_.expression_upper);
    PerspectiveFitSummary& summary = result_.summary;
    start_pose(local_.points(c));
    summary.stop = FitStop::iteration_limit;
    while (summary.iterations < options_.fit.iterations) {
      const Eigen::VectorXd next = shape_step(local_.points(c));
      summary.last_change = next.size() > 0 ? (next - c).cwiseAbs().maxCoeff() : 0;
      c = next;
      update_pose(local_.points(c));
      ++summary.iterations;
      if (summary.last_change > options_.fit.tolerance) continue;
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
      if (seen_[k].jaw_place == 0 || seen_[k].jaw_place == 9 || options_.fit.jaw == JawMode::fixed)
        rows.push_back(static_cast<Eigen::Index>(k));
    PerspectiveOptions rough = options_.camera;
    if (focal_is_free_) rough.focal_px = rough.prior_focal_px;  // the mean face's shape must not pass for perspective
    result_.camera = estimate_perspective_camera(X(rows, Eigen::all), pixels_(rows, Eigen::all), rough).camera;
    update_pose(X);
  }

  /// fit_shape's problem with an affine camera per landmark: landmarks of a flat model whose x and y are pixels. A free
  /// focal length adds one observation, its prior.
  Eigen::VectorXd shape_step(const Vertices& X) {
    const auto K = static_cast<Eigen::Index>(seen_.size());
    const Eigen::Index extra = focal_is_free_ ? 1 : 0;
    LandmarkShapeModel flat;
    flat.mean = Eigen::VectorXd::Zero(3 * (K + extra));
    flat.basis = Eigen::MatrixXd::Zero(3 * (K + extra), local_.basis.cols());
    for (Eigen::Index k = 0; k < K; ++k) {
      const AffineCamera near = result_.camera.affine_at(X.row(k).transpose());
      flat.mean.segment<2>(3 * k) = near.project(local_.mean.segment<3>(3 * k));
      flat.basis.middleRows<2>(3 * k) = near.A * local_.basis.middleRows<3>(3 * k);
    }
    std::vector<Observation> seen = seen_;
    std::vector<Information> W = W_;
    Eigen::MatrixXd N = Eigen::MatrixXd::Zero(2 * (K + extra), focal_is_free_ ? 7 : 6);
    N.topRows(2 * K) = pixel_derivative(result_.camera, X, X.colwise().mean().transpose(), focal_is_free_);
    if (focal_is_free_) {
      const double s = options_.camera.prior_focal_spread;
      seen.push_back({});
      seen.back().pixel[0] = std::log(options_.camera.prior_focal_px / result_.camera.focal_px);
      W.push_back(Eigen::Vector2d(1 / (s * s), 0).asDiagonal().toDenseMatrix());
      N(2 * K, 6) = 1;
    }
    AffineCamera onto_pixels;
    onto_pixels.A.leftCols<2>().setIdentity();
    if (ridge_.size() == 0 || ridge_.isConstant(0)) return fit_shape(flat, seen, onto_pixels, W, 0, N);
    WhitenedRows rows;
    whiten(rows, flat, seen, onto_pixels, W, N);
    Eigen::MatrixXd G;
    gram(G, rows);
    eliminate(G, N.cols());
    return bounded(G, N.cols());
  }

  /// Minimum of the normal equations [camera | coefficients | r], the camera taken out: shape free, blendshapes within
  /// their bounds.
  Eigen::VectorXd bounded(Eigen::MatrixXd& G, Eigen::Index P) const {
    const Eigen::Index M = ridge_.size(), E = context_.rows.expressions();
    G.diagonal().segment(P, M) += ridge_;
    const Eigen::MatrixXd H = G.block(P, P, M, M).selfadjointView<Eigen::Lower>();
    const Eigen::VectorXd g = G.row(P + M).segment(P, M).transpose();
    if (!context_.has_blendshapes) return H.ldlt().solve(g);
    constexpr double infinity = std::numeric_limits<double>::infinity();
    Eigen::VectorXd lower = Eigen::VectorXd::Constant(M, -infinity), upper = Eigen::VectorXd::Constant(M, infinity);
    lower.tail(E) = context_.expression_lower;
    upper.tail(E) = context_.expression_upper;
    return minimise_bounded(H, g, lower, upper).x;
  }

  void update_pose(const Vertices& X) {
    update_weights(X);
    result_.camera = refine_perspective(result_.camera, X, pixels_, W_, options_.camera).camera;
    result_.pose = head_pose(result_.camera.R);
    update_weights(X);
  }

  /// As the viewer sees it, a head beside the optical axis is turned: what counts for hidden jaws.
  double apparent_yaw(const Eigen::Vector3d& centre) const {
    const Eigen::Vector3d ray = result_.camera.in_camera(centre);
    return head_pose(Eigen::Quaterniond::FromTwoVectors(ray, -Eigen::Vector3d::UnitZ()) * result_.camera.R).yaw;
  }

  void update_weights(const Vertices& X) {
    const Eigen::Vector3d centre = X.colwise().mean().transpose();
    const double depth = result_.camera.depth(centre);
    ObservationNoise noise;
    noise.sigma_px =
        options_.fit.sigma_px > 0 ? options_.fit.sigma_px : options_.fit.sigma_mm * result_.camera.focal_px / depth;
    noise.jaw_factor = options_.fit.jaw_factor;
    noise.jaw = options_.fit.jaw;
    result_.summary.sigma_px = noise.sigma_px;
    result_.summary.distance_mm = depth;
    W_ = informations(seen_, projected(X), apparent_yaw(centre), noise);
  }

  Pixels projected(const Vertices& X) const {
    Pixels x(X.rows(), 2);
    for (Eigen::Index k = 0; k < X.rows(); ++k) x.row(k) = result_.camera.project(X.row(k).transpose()).transpose();
    return x;
  }

  /// Inverse of the joint Hessian of camera and shape.
  void uncertainty(const Vertices& X) {
    const auto K = static_cast<Eigen::Index>(seen_.size());
    const Eigen::Index P = focal_is_free_ ? 7 : 6, M = local_.basis.cols();
    Eigen::MatrixXd J(2 * K, P + M), WJ(2 * K, P + M);
    J.leftCols(P) = pixel_derivative(result_.camera, X, X.colwise().mean().transpose(), focal_is_free_);
    for (Eigen::Index k = 0; k < K; ++k) {
      J.block(2 * k, P, 2, M) = result_.camera.affine_at(X.row(k).transpose()).A * local_.basis.middleRows<3>(3 * k);
      WJ.middleRows<2>(2 * k) = W_[static_cast<size_t>(k)] * J.middleRows<2>(2 * k);
    }
    Eigen::MatrixXd H = J.transpose() * WJ;
    H.diagonal().tail(M) += ridge_.cwiseMax(1e-12);
    if (focal_is_free_) H(6, 6) += 1 / std::pow(options_.camera.prior_focal_spread, 2);
    const Eigen::VectorXd scale = H.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::VectorXd variance =
        (scale.asDiagonal() * H * scale.asDiagonal()).ldlt().solve(Eigen::MatrixXd::Identity(P + M, P + M)).diagonal();
    const Eigen::VectorXd spread = variance.cwiseMax(0).cwiseSqrt().cwiseProduct(scale);
    result_.coefficient_spread = spread.tail(M);
    if (!focal_is_free_) return;
    result_.summary.focal_spread = spread[6];
    result_.summary.focal_determined = spread[6] < 0.5 * options_.camera.prior_focal_spread;
  }

  void finish(const Eigen::VectorXd& c) {
    PerspectiveFitSummary& summary = result_.summary;
    const Eigen::Index E = context_.rows.expressions();
    result_.shape_coefficients = c.head(c.size() - E);
    if (context_.has_modes) result_.expression_coefficients = c.tail(E);
    if (context_.has_blendshapes)
      for (Eigen::Index i = 0; i < E; ++i)
        result_.blendshape_weights[context_.model.blendshapes()[static_cast<size_t>(i)].name] = c[c.size() - E + i];
    const Vertices X = local_.points(c);
    const Pixels fitted = projected(X);
    double sum = 0;
    int count = 0;
    for (size_t k = 0; k < seen_.size(); ++k) {
      const Eigen::Vector2d there = fitted.row(static_cast<Eigen::Index>(k)).transpose();
      LandmarkResidual residual;
      residual.name = seen_[k].name;
      residual.vertex = seen_[k].vertex;
      residual.measured = seen_[k].pixel;
      residual.fitted = there;
      residual.used = !W_[k].isZero(0);
      summary.residuals.push_back(residual);
      if (!determines_point(W_[k])) continue;  // ignored, or free to slide
      sum += (seen_[k].pixel - there).squaredNorm();
      ++count;
    }
    summary.rms_px = std::sqrt(sum / std::max(count, 1));
    summary.outer_eye_distance_px = eye_distance();
    if (summary.outer_eye_distance_px > 0) summary.rms_percent = 100 * summary.rms_px / summary.outer_eye_distance_px;
    summary.options = options_;
    uncertainty(X);
  }

  double eye_distance() const {
    const Observation *right = nullptr, *left = nullptr;
    for (const Observation& o : seen_) {
      if (o.name == "37") right = &o;
      if (o.name == "46") left = &o;
    }
    return right && left ? (right->pixel - left->pixel).norm() : 0;
  }

  PerspectiveFitOptions options_;
  FitContext context_;  ///< refers to options_
  std::vector<Observation> seen_;
  bool focal_is_free_;
  LandmarkShapeModel local_;
  Eigen::VectorXd ridge_;  ///< weights of the prior, shape then expression
  Pixels pixels_;
  std::vector<Information> W_;
  PerspectiveFitResult result_;
};

}  // namespace

PerspectiveFitResult fit_landmarks_perspective(const MorphableModel& model, const ImageLandmarks& landmarks,
                                               const PerspectiveFitOptions& options, const LandmarkMapper& mapper) {
  return PerspectiveFit(model, landmarks, options, mapper).run();
}

Mesh fitted_mesh(const MorphableModel& model, const PerspectiveFitResult& fit, int level) {
  FitResult same;
  same.shape_coefficients = fit.shape_coefficients;
  same.expression_coefficients = fit.expression_coefficients;
  same.blendshape_weights = fit.blendshape_weights;
  return fitted_mesh(model, same, level);
}

}  // namespace facewright
