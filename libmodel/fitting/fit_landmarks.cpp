// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/fit_landmarks.h"

#include <Eigen/QR>
#include <algorithm>
#include <limits>
#include <memory>
#include <stdexcept>

#include "libmodel/core/errors.h"
#include "libmodel/fitting/image_fit.h"

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
  expect(o.expression.lambda >= 0, "expression.lambda >= 0");
  expect(o.expression.blendshape_sigma > 0, "expression.blendshape_sigma > 0");
  expect(o.expression.lower <= o.expression.upper, "expression.lower <= expression.upper");
  expect(o.contour.rounds >= 0, "contour.rounds >= 0");
  expect(o.contour.largest_distance > 0, "contour.largest_distance > 0");
}

/// The images of one person and their common shape; each step is one line of the algorithm.
class CommonShape {
 public:
  CommonShape(const FitContext& context, std::vector<ImageFit*> images)
      : context_(context), images_(std::move(images)), shape_(Eigen::VectorXd::Zero(context.rows.shape_modes())) {}

  void run() {
    stop_ = FitStop::iteration_limit;
    while (iterations_ < context_.options.iterations) {
      for (ImageFit* image : images_) image->linearise();
      const Eigen::VectorXd next = solve();
      change_ = next.size() > 0 ? (next - shape_).cwiseAbs().maxCoeff() : 0;
      shape_ = next;
      for (ImageFit* image : images_) change_ = std::max(change_, image->follow(shape_));
      ++iterations_;
      const bool outline_moves =
          context_.options.jaw == JawMode::contour && iterations_ < context_.options.contour.rounds;
      if (change_ > context_.options.tolerance || outline_moves) continue;
      stop_ = FitStop::converged;
      break;
    }
  }

  const Eigen::VectorXd& shape() const { return shape_; }

  /// Of the last round's posterior: H^-1; infinite where nothing determines a coefficient.
  Eigen::MatrixXd covariance() const {
    const Eigen::Index M = shape_.size();
    if (determined_ && M > 0) return solver_.inverse();
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(M, M);
    out.diagonal().setConstant(std::numeric_limits<double>::infinity());
    return out;
  }

  template <typename Summary>
  void report(Summary& summary) const {
    summary.stop = stop_;
    summary.iterations = iterations_;
    summary.last_change = change_;
  }

 private:
  /// The shape of all images' linearised residuals; bounded expressions and shape in turns until the same weights are
  /// at their bounds as before: then both are the minimum together.
  Eigen::VectorXd solve() {
    Eigen::VectorXd shape = shape_;
    for (ImageFit* image : images_)
      if (context_.has_blendshapes) image->settle_expression(shape);
    for (int turn = 0; turn < 20; ++turn) {
      shape = solve_shape();
      bool changed = false;
      for (ImageFit* image : images_) changed = image->settle_expression(shape) || changed;
      if (!changed) break;
    }
    return shape;
  }

  Eigen::VectorXd solve_shape() {
    const Eigen::Index M = shape_.size();
    if (M == 0) return shape_;
    H_.setZero(M, M);
    g_.setZero(M);
    for (const ImageFit* image : images_) image->add(H_, g_);
    H_.diagonal().array() += context_.options.lambda;
    determined_ = solver_.compute(H_);
    if (determined_) return solver_.solve(g_);
    const Eigen::MatrixXd H = H_.selfadjointView<Eigen::Lower>();  // no prior: the solution of least norm
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> least;
    least.setThreshold(1e-12);
    return least.compute(H).solve(g_);
  }

  const FitContext& context_;
  std::vector<ImageFit*> images_;
  Eigen::VectorXd shape_, g_;
  Eigen::MatrixXd H_;
  PositiveDefiniteSolver solver_;
  bool determined_ = true;
  FitStop stop_ = FitStop::not_run;
  int iterations_ = 0;
  double change_ = 0;
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

Eigen::VectorXd FitResult::shape_stddevs() const { return shape_covariance.diagonal().cwiseSqrt(); }

FitResult fit_landmarks(const MorphableModel& model, const ImageLandmarks& landmarks, const FitOptions& options,
                        const LandmarkMapper& mapper) {
  check(options);
  const FitContext context(model, options, mapper);
  ImageFit image(context, landmarks);
  CommonShape person(context, {&image});
  person.run();
  FitResult result = image.result(person.shape());
  result.shape_covariance = person.covariance();
  person.report(result.summary);
  return result;
}

MultiFitResult fit_landmarks_multi(const MorphableModel& model, const std::vector<ImageLandmarks>& images,
                                   const FitOptions& options, const LandmarkMapper& mapper) {
  check(options);
  const FitContext context(model, options, mapper);
  MultiFitResult result;
  result.images.resize(images.size());
  std::vector<std::unique_ptr<ImageFit>> fits(images.size());
  std::vector<ImageFit*> usable;
  for (size_t i = 0; i < images.size(); ++i) try {
      fits[i] = std::make_unique<ImageFit>(context, images[i]);
      usable.push_back(fits[i].get());
    } catch (const std::runtime_error& e) {  // InvalidInput or SolverError
      result.summary.failed[i] = e.what();
    }
  if (usable.empty())
    throw InvalidInput(images.empty() ? "fit: expected at least one image"
                                      : "fit: none of the images can be used; the first: " +
                                            result.summary.failed.begin()->second);
  CommonShape person(context, usable);
  person.run();
  result.shape_coefficients = person.shape();
  result.shape_covariance = person.covariance();
  result.summary.used_images = static_cast<int>(usable.size());
  person.report(result.summary);
  for (size_t i = 0; i < images.size(); ++i) {
    if (!fits[i]) continue;
    result.images[i] = fits[i]->result(person.shape());
    person.report(result.images[i].summary);
  }
  return result;
}

Mesh fitted_mesh(const MorphableModel& model, const FitResult& fit, int level) {
  Mesh mesh = model.instance(fit.shape_coefficients, {}, level, fit.expression_coefficients);
  for (const Blendshape& b : model.blendshapes())
    if (const auto weight = fit.blendshape_weights.find(b.name); weight != fit.blendshape_weights.end())
      mesh.V += weight->second * as_vertices(b.displacement.head(mesh.V.size()));
  return mesh;
}

}  // namespace facewright
