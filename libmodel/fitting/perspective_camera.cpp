// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/perspective_camera.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/fitting/orthographic_camera.h"

namespace facewright {
namespace {

using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;
using Jacobian = Eigen::Matrix<double, 2, 7>;

void check(const PerspectiveOptions& o) {
  const auto expect = [](bool ok, const char* what) {
    if (!ok) throw InvalidInput(std::string("perspective camera: expected ") + what);
  };
  expect(std::isfinite(o.focal_px) && o.focal_px >= 0, "focal_px >= 0 (0 = unknown)");
  expect(o.principal.allFinite(), "a finite principal point");
  expect(o.focal_px > 0 || (std::isfinite(o.prior_focal_px) && o.prior_focal_px > 0),
         "a focal length, or prior_focal_px > 0 (1.2 times the longer side of the image)");
  expect(o.focal_px > 0 || o.prior_focal_spread > 0, "prior_focal_spread > 0");
  expect(o.iterations >= 1, "iterations >= 1");
}

/// By rotation about the centre, shift (pixels at the centre), log scale at the centre, log focal length at that scale.
/// p = R (x - centre), c = the centre in camera axes.
Jacobian jacobian(double focal, const Eigen::Vector3d& p, const Eigen::Vector3d& c) {
  const Eigen::Vector3d q = p + c;
  const double d = -q[2], depth = -c[2];
  Eigen::Matrix<double, 2, 3> D;  // of the pixel by q
  D << 1, 0, q[0] / d, 0, -1, -q[1] / d;
  D *= focal / d;
  const Eigen::Vector2d pixel = focal / d * Eigen::Vector2d(q[0], -q[1]);  // from the principal point
  Jacobian J;
  J << D.col(2) * p[1] - D.col(1) * p[2], D.col(0) * p[2] - D.col(2) * p[0], D.col(1) * p[0] - D.col(0) * p[1],
      D.col(0) * (depth / focal), D.col(1) * (-depth / focal), -(D * c), pixel + D * c;
  return J;
}

PerspectiveCamera moved(const PerspectiveCamera& camera, const Eigen::Vector3d& centre, const Vector7& step) {
  PerspectiveCamera out = camera;
  const double angle = step.head<3>().norm();
  if (angle > 0)
    out.R = Eigen::Quaterniond(Eigen::AngleAxisd(angle, step.head<3>() / angle).toRotationMatrix() * camera.R)
                .normalized()
                .toRotationMatrix();
  Eigen::Vector3d c = camera.in_camera(centre);
  const double mm_per_pixel = -c[2] / camera.focal_px;
  c += Eigen::Vector3d(step[3], -step[4], 0) * mm_per_pixel;
  c *= std::exp(std::clamp(step[6] - step[5], -1.0, 1.0));
  out.focal_px = camera.focal_px * std::exp(std::clamp(step[6], -1.0, 1.0));
  out.t = c - out.R * centre;
  return out;
}

/// Weighted mean of the points that count.
Eigen::Vector3d centre_of(const Vertices& X, const std::vector<Information>& W) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double total = 0;
  for (Eigen::Index k = 0; k < X.rows(); ++k) {
    const double w = W[static_cast<size_t>(k)].trace();
    sum += w * X.row(k).transpose();
    total += w;
  }
  if (!(total > 0)) throw SolverError("perspective camera: no landmark has any weight");
  return sum / total;
}

/// One problem; the unknowns are the first `size` of the seven.
class Refinement {
 public:
  Refinement(const Vertices& X, const Pixels& x, const std::vector<Information>& W, const PerspectiveOptions& options)
      : X_(X), x_(x), W_(W), options_(options), centre_(centre_of(X, W)), size_(options.focal_px > 0 ? 6 : 7) {}

  PerspectiveResult run(PerspectiveCamera camera) {
    PerspectiveResult result{camera, {}};
    double cost = this->cost(camera), damping = 1e-6;
    if (!std::isfinite(cost)) throw SolverError("perspective camera: landmarks lie behind the first camera");
    while (result.summary.iterations < options_.iterations && !result.summary.converged) {
      ++result.summary.iterations;
      linearise(camera);
      Vector7 step = Vector7::Zero();
      for (int attempt = 0;; ++attempt) {
        step.head(size_) = solve(damping);
        const PerspectiveCamera next = moved(camera, centre_, step);
        const double next_cost = this->cost(next);
        // what is left may be rounding: a step that is not better by more does no harm either
        if (next_cost <= cost * (1 + 1e-13) + 1e-22) {
          camera = next;
          cost = next_cost;
          damping = std::max(damping * 0.1, 1e-15);
          break;
        }
        damping *= 10;
        if (attempt > 40) {  // no step is better: this is the minimum
          step.setZero();
          break;
        }
      }
      result.summary.converged = step.head<3>().norm() + step.tail<2>().norm() < options_.tolerance;
    }
    result.camera = camera;
    finish(result);
    return result;
  }

 private:
  double prior_residual(const PerspectiveCamera& camera) const {
    return size_ == 7 ? std::log(options_.prior_focal_px / camera.focal_px) / options_.prior_focal_spread : 0;
  }

  double cost(const PerspectiveCamera& camera) const {
    double sum = prior_residual(camera) * prior_residual(camera);
    for (Eigen::Index k = 0; k < X_.rows(); ++k) {
      const Information& W = W_[static_cast<size_t>(k)];
      if (W.isZero(0)) continue;
      const Eigen::Vector3d X = X_.row(k).transpose();
      if (!(camera.depth(X) > 0)) return std::numeric_limits<double>::infinity();
      const Eigen::Vector2d r = x_.row(k).transpose() - camera.project(X);
      sum += r.dot(W * r);
    }
    return sum;
  }

  void linearise(const PerspectiveCamera& camera) {
    H_.setZero();
    g_.setZero();
    const Eigen::Vector3d c = camera.in_camera(centre_);
    for (Eigen::Index k = 0; k < X_.rows(); ++k) {
      const Information& W = W_[static_cast<size_t>(k)];
      if (W.isZero(0)) continue;
      const Eigen::Vector3d X = X_.row(k).transpose();
      const Jacobian J = jacobian(camera.focal_px, camera.R * (X - centre_), c);
      const Eigen::Vector2d r = x_.row(k).transpose() - camera.project(X);
      H_ += J.transpose() * W * J;
      g_ += J.transpose() * (W * r);
    }
    if (size_ < 7) return;
    const double s = options_.prior_focal_spread;
    H_(6, 6) += 1 / (s * s);
    g_[6] += prior_residual(camera) / s;
  }

  /// The matrix scaled to a unit diagonal, so that pixels and radians do not matter to the test of its rank.
  Eigen::LDLT<Eigen::MatrixXd> factor(double damping, Eigen::VectorXd& scale) const {
    scale = H_.diagonal().head(size_).cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    Eigen::MatrixXd S = scale.asDiagonal() * H_.topLeftCorner(size_, size_) * scale.asDiagonal();
    Eigen::LDLT<Eigen::MatrixXd> plain(S);
    if (plain.info() != Eigen::Success || !(plain.rcond() > 1e-13))
      throw SolverError("perspective camera: too few landmarks with weight to determine the pose");
    if (damping == 0) return plain;
    S.diagonal().array() += damping;
    return Eigen::LDLT<Eigen::MatrixXd>(S);
  }
  Eigen::VectorXd solve(double damping) const {
    Eigen::VectorXd scale;
    const auto solver = factor(damping, scale);
    return scale.asDiagonal() * solver.solve(scale.asDiagonal() * g_.head(size_));
  }

  void finish(PerspectiveResult& result) {
    double sum = 0;
    int count = 0;
    for (Eigen::Index k = 0; k < X_.rows(); ++k) {
      if (W_[static_cast<size_t>(k)].isZero(0)) continue;
      sum += (x_.row(k).transpose() - result.camera.project(X_.row(k).transpose())).squaredNorm();
      ++count;
    }
    result.summary.rms_px = std::sqrt(sum / std::max(count, 1));
    if (size_ < 7) return;
    linearise(result.camera);
    Eigen::VectorXd scale;
    const auto solver = factor(0, scale);
    result.summary.focal_spread = std::sqrt(solver.solve(Eigen::VectorXd::Unit(7, 6))[6]) * scale[6];
    result.summary.focal_determined = result.summary.focal_spread < 0.5 * options_.prior_focal_spread;
  }

  const Vertices& X_;
  const Pixels& x_;
  const std::vector<Information>& W_;
  PerspectiveOptions options_;
  Eigen::Vector3d centre_;
  Eigen::Index size_;
  Matrix7 H_ = Matrix7::Zero();
  Vector7 g_ = Vector7::Zero();
};

}  // namespace

PerspectiveCamera perspective_from_orthographic(const OrthographicCamera& camera, double focal_px,
                                                const Eigen::Vector2d& principal, const Eigen::Vector3d& centre) {
  const Eigen::Vector2d p = camera.affine().project(centre) - principal;
  const Eigen::Vector3d ray(p[0] / focal_px, -p[1] / focal_px, -1);
  PerspectiveCamera out;
  out.focal_px = focal_px;
  out.principal = principal;
  out.R = Eigen::Quaterniond::FromTwoVectors(-Eigen::Vector3d::UnitZ(), ray) * camera.R;
  out.t = focal_px / camera.s * ray - out.R * centre;
  return out;
}

PerspectiveResult refine_perspective(const PerspectiveCamera& start, const Vertices& X, const Pixels& x,
                                     const std::vector<Information>& W, const PerspectiveOptions& options) {
  check(options);
  if (X.rows() != x.rows() || static_cast<size_t>(X.rows()) != W.size())
    throw InvalidInput("perspective camera: expected as many pixels and weights as points, got " +
                       std::to_string(X.rows()) + ", " + std::to_string(x.rows()) + " and " + std::to_string(W.size()));
  PerspectiveCamera camera = start;
  camera.principal = options.principal;
  if (options.focal_px > 0) camera.focal_px = options.focal_px;
  return Refinement(X, x, W, options).run(camera);
}

PerspectiveResult estimate_perspective_camera(const Vertices& X, const Pixels& x, const PerspectiveOptions& options,
                                              const std::vector<Information>& W) {
  check(options);
  const Eigen::Index least = options.focal_px > 0 ? 4 : 5;
  if (X.rows() < least)
    throw InvalidInput("perspective camera: expected at least " + std::to_string(least) + " points, got " +
                       std::to_string(X.rows()));
  const OrthographicCamera near = nearest_orthographic(estimate_affine_camera(X, x).camera);
  const double focal = options.focal_px > 0 ? options.focal_px : options.prior_focal_px;
  const PerspectiveCamera start =
      perspective_from_orthographic(near, focal, options.principal, X.colwise().mean().transpose());
  const std::vector<Information> equal(static_cast<size_t>(X.rows()), Information::Identity());
  return refine_perspective(start, X, x, W.empty() ? equal : W, options);
}

Eigen::MatrixXd pixel_derivative(const PerspectiveCamera& camera, const Vertices& X, const Eigen::Vector3d& centre,
                                 bool with_focal) {
  const Eigen::Vector3d c = camera.in_camera(centre);
  Eigen::MatrixXd J(2 * X.rows(), with_focal ? 7 : 6);
  for (Eigen::Index k = 0; k < X.rows(); ++k)
    J.middleRows<2>(2 * k) =
        jacobian(camera.focal_px, camera.R * (X.row(k).transpose() - centre), c).leftCols(J.cols());
  return J;
}

}  // namespace facewright
