// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/affine_camera.h"

#include <Eigen/SVD>
#include <cmath>
#include <limits>
#include <string>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

/// Centroid to the origin, root mean square distance to sqrt(dimension): x -> scale (x - centre).
template <int D>
struct Normalisation {
  Eigen::Matrix<double, 1, D> centre;
  double scale = 1;

  template <typename Points>
  explicit Normalisation(const Points& points) : centre(points.colwise().mean()) {
    const double mean_square = (points.rowwise() - centre).rowwise().squaredNorm().mean();
    scale = mean_square > 0 ? std::sqrt(D / mean_square) : 1;
  }
  template <typename Points>
  Eigen::MatrixXd apply(const Points& points) const {
    return scale * (points.rowwise() - centre);
  }
};

void check(const Vertices& X, const Pixels& x) {
  if (X.rows() != x.rows())
    throw InvalidInput("camera: " + std::to_string(X.rows()) + " model points for " + std::to_string(x.rows()) +
                       " image points");
  if (X.rows() < 4)
    throw InvalidInput("camera: expected at least 4 landmarks, got " + std::to_string(X.rows()) +
                       "; mark more landmarks that the model has");
  if (!X.allFinite() || !x.allFinite()) throw InvalidInput("camera: a landmark is not finite");
}

}  // namespace

AffineCameraResult estimate_affine_camera(const Vertices& X, const Pixels& x) {
  check(X, x);
  const Normalisation<3> U(X);
  const Normalisation<2> T(x);
  Eigen::MatrixXd A(X.rows(), 4);
  A << U.apply(X), Eigen::VectorXd::Ones(X.rows());
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  AffineCameraResult result;
  const double smallest = svd.singularValues()[3];
  result.summary.condition =
      smallest > 0 ? svd.singularValues()[0] / smallest : std::numeric_limits<double>::infinity();
  if (!(result.summary.condition < 1e6))
    throw InvalidInput(
        "camera: the landmarks lie in a plane of the model, so the pose is undetermined; "
        "add landmarks of other depth, such as the nose tip");
  const Eigen::Matrix<double, 4, 2> P = svd.solve(T.apply(x));
  // Undo the normalisations: scale_x (A X + b - centre_x) = P^T (scale_X (X - centre_X), 1).
  result.camera.A = U.scale / T.scale * P.topRows<3>().transpose();
  result.camera.b = P.row(3).transpose() / T.scale + T.centre.transpose() - result.camera.A * U.centre.transpose();
  const Pixels projected = (X * result.camera.A.transpose()).rowwise() + result.camera.b.transpose();
  result.summary.points = static_cast<int>(X.rows());
  result.summary.rms_px = std::sqrt((projected - x).rowwise().squaredNorm().mean());
  return result;
}

Eigen::MatrixXd pixel_derivative(const Vertices& X) {
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(2 * X.rows(), 8);
  for (Eigen::Index k = 0; k < X.rows(); ++k) {
    J.block<1, 4>(2 * k, 0) << X.row(k), 1;
    J.block<1, 4>(2 * k + 1, 4) << X.row(k), 1;
  }
  return J;
}

}  // namespace facewright
