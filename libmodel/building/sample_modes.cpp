// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/sample_modes.h"

#include <algorithm>

#include "libmodel/building/eigen_pairs.h"

namespace facewright {
namespace {

constexpr double kRelativeFloor =
    1e-12;  // as fit_pca: below this share of the first mode lies rounding of the Gram matrix
constexpr double kRoundingFloor = 1e-24;  // as fit_pca: (1e-12)^2 of |mean|^2

Eigen::MatrixXd recentred(const Eigen::MatrixXd& G, const std::vector<int>& rows) {
  Eigen::MatrixXd B = G(rows, rows);
  const Eigen::VectorXd mean = B.rowwise().mean();
  const double overall = mean.mean();
  B.colwise() -= mean;
  B.rowwise() -= mean.transpose();
  B.array() += overall;
  return 0.5 * (B + B.transpose());
}

}  // namespace

SampleModes sample_modes(const Eigen::MatrixXd& G, const std::vector<int>& rows, double rounding) {
  const auto n = static_cast<Eigen::Index>(rows.size());
  SampleModes modes{Eigen::VectorXd(0), Eigen::MatrixXd(n, 0), Eigen::MatrixXd(n, 0)};
  if (n < 2) return modes;
  EigenPairs pairs = all_eigenpairs(recentred(G, rows));
  const double floor = std::max(kRelativeFloor * pairs.values[0], rounding * static_cast<double>(n - 1));
  const Eigen::Index k = std::min<Eigen::Index>(n - 1, (pairs.values.array() > floor).count());
  pairs.values.conservativeResize(k);
  pairs.vectors.conservativeResize(n, k);
  for (Eigen::Index m = 0; m < k; ++m)
    if (pairs.vectors.col(m).array().cube().sum() < 0) pairs.vectors.col(m) *= -1;
  modes.variances = pairs.values / static_cast<double>(n - 1);
  const Eigen::VectorXd norms = pairs.values.cwiseSqrt();
  modes.weights = pairs.vectors * norms.cwiseInverse().asDiagonal();
  modes.scores = pairs.vectors * norms.asDiagonal();
  return modes;
}

double rounding_variance(const Eigen::RowVectorXd& mean) { return kRoundingFloor * mean.squaredNorm(); }

Eigen::RowVectorXd mean_of_rows(const SampleMatrix& X, const std::vector<int>& rows) {
  Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(X.cols());
  for (const int i : rows) mean += X.row(i);
  return mean / static_cast<double>(rows.size());
}

}  // namespace facewright
