// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/symmetric_spline.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "libmodel/core/errors.h"
#include "libregister/registration/thin_plate_spline.h"

namespace facewright {
namespace {

constexpr double kUnit = 100;  // mm: the distance at which the amplitude is stated
constexpr Eigen::Index kAffine = 12;

// Covariance of two components of a field with kernel -r, up to what the affine part takes up.
double covariance(const SplineDatum& a, const SplineDatum& b) {
  return -(a.point - b.point).norm() / kUnit * a.direction.dot(b.direction);
}

SplineDatum reflected(const SplineDatum& d, const SymmetryPlane& plane) {
  return {plane.reflect_point(d.point), plane.reflect_direction(d.direction), d.value, d.stddev};
}

// A field f = s + a with s symmetric, a antisymmetric, in proportion 1 to `asymmetry`:
// cov = (1 + q^2) / 2 k(x, y) + (1 - q^2) / 2 k(x, mirrored y).
Eigen::MatrixXd kernel_matrix(const std::vector<SplineDatum>& data, const SymmetryPlane* plane, double asymmetry) {
  const auto n = static_cast<Eigen::Index>(data.size());
  const double own = plane ? 0.5 * (1 + asymmetry * asymmetry) : 1, other = 1 - own;
  std::vector<SplineDatum> twins;
  if (plane)
    for (const SplineDatum& d : data) twins.push_back(reflected(d, *plane));
  Eigen::MatrixXd K(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) {
      K(i, j) = own * covariance(data[i], data[j]);
      if (plane) K(i, j) += other * covariance(data[i], twins[j]);
      K(j, i) = K(i, j);
    }
  return K;
}

// Rows: d, d x^T / unit of f(x) = c + A x / unit, seen along d.
Eigen::MatrixXd affine_basis(const std::vector<SplineDatum>& data, const Eigen::Vector3d& centre) {
  Eigen::MatrixXd B(static_cast<Eigen::Index>(data.size()), kAffine);
  for (Eigen::Index i = 0; i < B.rows(); ++i) {
    const SplineDatum& d = data[static_cast<size_t>(i)];
    const Eigen::Vector3d x = (d.point - centre) / kUnit;
    for (int c = 0; c < 3; ++c) {
      B(i, c) = d.direction[c];
      for (int k = 0; k < 3; ++k) B(i, 3 + 3 * c + k) = d.direction[c] * x[k];
    }
  }
  return B;
}

Eigen::Vector3d centre_of(const std::vector<SplineDatum>& data) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const SplineDatum& d : data) sum += d.point;
  return sum / static_cast<double>(std::max<size_t>(1, data.size()));
}

// The data freed of their affine part and scaled to unit noise: uncorrelated with variances a^2 l_i + s^2.
struct Spectrum {
  Eigen::ArrayXd eigenvalues, squares;
};

Spectrum spectrum(const std::vector<SplineDatum>& data, const SymmetryPlane* plane, double asymmetry) {
  const auto n = static_cast<Eigen::Index>(data.size());
  Eigen::VectorXd scale(n), y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    scale[i] = 1 / data[static_cast<size_t>(i)].stddev;
    y[i] = data[static_cast<size_t>(i)].value * scale[i];
  }
  const Eigen::MatrixXd B = scale.asDiagonal() * affine_basis(data, centre_of(data));
  const Eigen::MatrixXd Q = Eigen::HouseholderQR<Eigen::MatrixXd>(B).householderQ();
  const Eigen::MatrixXd Z = Q.rightCols(n - kAffine);
  const Eigen::MatrixXd K = scale.asDiagonal() * kernel_matrix(data, plane, asymmetry) * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(Z.transpose() * K * Z);
  return {eigen.eigenvalues().array().max(0.0),
          (eigen.eigenvectors().transpose() * (Z.transpose() * y)).array().square()};
}

double log_prior(double value, double centre, double spread) {
  const double d = std::log(value / centre) / spread;
  return -0.5 * d * d;
}

}  // namespace

void add_displacement(const Eigen::Vector3d& point, const Eigen::Vector3d& displacement, double stddev,
                      std::vector<SplineDatum>* data) {
  for (int c = 0; c < 3; ++c) data->push_back({point, Eigen::Vector3d::Unit(c), displacement[c], stddev});
}

SplineSmoothness estimate_smoothness(const std::vector<SplineDatum>& data, const SymmetryPlane* plane,
                                     const SmoothnessOptions& options) {
  if (static_cast<Eigen::Index>(data.size()) <= kAffine)
    throw InvalidInput("symmetric spline: " + std::to_string(data.size()) + " data cannot tell how smooth a field is");
  SplineSmoothness best;
  double highest = -std::numeric_limits<double>::infinity();
  for (const double asymmetry : plane ? std::vector<double>{0.15, 0.3, 0.6} : std::vector<double>{1.0}) {
    const Spectrum s = spectrum(data, plane, asymmetry);
    for (int i = -8; i <= 8; ++i)      // a quarter to four times the usual amplitude
      for (int j = -8; j <= 8; ++j) {  // and the stated noise
        const SplineSmoothness now{options.amplitude * std::pow(2.0, 0.25 * i), std::pow(2.0, 0.25 * j), asymmetry};
        const Eigen::ArrayXd v = now.amplitude * now.amplitude * s.eigenvalues + now.noise * now.noise;
        const double likelihood = -0.5 * (v.log() + s.squares / v).sum() +
                                  log_prior(now.amplitude, options.amplitude, options.amplitude_spread) +
                                  log_prior(now.noise, 1, options.noise_spread);
        if (likelihood > highest) highest = likelihood, best = now;
      }
  }
  return best;
}

SymmetricSpline::SymmetricSpline(const std::vector<SplineDatum>& data, const SymmetryPlane* plane,
                                 const SplineSmoothness& smoothness)
    : centre_(centre_of(data)) {
  const auto n = static_cast<Eigen::Index>(data.size());
  const double a2 = smoothness.amplitude * smoothness.amplitude;
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(n + kAffine, n + kAffine);
  G.topLeftCorner(n, n) = a2 * kernel_matrix(data, plane, smoothness.asymmetry);
  G.topRightCorner(n, kAffine) = affine_basis(data, centre_);
  if (Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(G.topRightCorner(n, kAffine)).rank() < kAffine)
    throw InvalidInput("symmetric spline: the data are too few, or lie in a plane");
  G.bottomLeftCorner(kAffine, n) = G.topRightCorner(n, kAffine).transpose();
  Eigen::VectorXd y = Eigen::VectorXd::Zero(n + kAffine);
  for (Eigen::Index i = 0; i < n; ++i) {
    const SplineDatum& d = data[static_cast<size_t>(i)];
    G(i, i) += std::pow(smoothness.noise * d.stddev, 2);
    y[i] = d.value;
    radius_ = std::max(radius_, (d.point - centre_).norm());
  }
  const Eigen::VectorXd c = G.partialPivLu().solve(y);
  const double own = plane ? 0.5 * (1 + smoothness.asymmetry * smoothness.asymmetry) : 1;
  // Data at one point, as the three components of a landmark, share a kernel.
  points_.resize(3, n), pulls_.setZero(3, n);
  Eigen::Index last = -1;
  for (Eigen::Index i = 0; i < n; ++i) {
    const SplineDatum& d = data[static_cast<size_t>(i)];
    if (last < 0 || points_.col(last) != d.point) points_.col(++last) = d.point;
    pulls_.col(last) -= a2 * own * c[i] / kUnit * d.direction;
  }
  points_.conservativeResize(3, last + 1), pulls_.conservativeResize(3, last + 1);
  if (plane) {
    mirrored_points_.resize(3, last + 1), mirrored_pulls_.resize(3, last + 1);
    for (Eigen::Index i = 0; i <= last; ++i) {
      mirrored_points_.col(i) = plane->reflect_point(points_.col(i));
      mirrored_pulls_.col(i) = (1 - own) / own * plane->reflect_direction(pulls_.col(i));
    }
  }
  affine_.row(0) = c.segment<3>(n).transpose();
  for (int k = 0; k < 3; ++k)
    for (int component = 0; component < 3; ++component) affine_(1 + k, component) = c[n + 3 + 3 * component + k];
}

Vertices SymmetricSpline::operator()(const Vertices& X) const {
  Vertices Y(X.rows(), 3);
  for (Eigen::Index i = 0; i < X.rows(); ++i) {
    const Eigen::Vector3d x = X.row(i), d = x - centre_;
    Eigen::Vector3d bend = Eigen::Vector3d::Zero();
    const double weight = bend_weight(d.norm(), radius_);
    if (weight > 0) {
      bend = pulls_ * (points_.colwise() - x).colwise().norm().transpose();
      if (mirrored_points_.cols() > 0)
        bend += mirrored_pulls_ * (mirrored_points_.colwise() - x).colwise().norm().transpose();
    }
    Y.row(i) = weight * bend.transpose() + affine_.row(0) + d.transpose() / kUnit * affine_.bottomRows<3>();
  }
  return Y;
}

}  // namespace facewright
