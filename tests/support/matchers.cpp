// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "tests/support/matchers.h"

namespace facewright::testing_support {

namespace {

bool same_size(const Eigen::Index rows_a, const Eigen::Index cols_a, const Eigen::Index rows_b,
               const Eigen::Index cols_b, ::testing::MatchResultListener* listener) {
  if (rows_a == rows_b && cols_a == cols_b) return true;
  *listener << "sizes differ: " << rows_a << " x " << cols_a << ", expected " << rows_b << " x " << cols_b;
  return false;
}

}  // namespace

bool match_matrix(const Eigen::MatrixXd& actual, const Eigen::MatrixXd& expected, double tolerance,
                  ::testing::MatchResultListener* listener) {
  if (!same_size(actual.rows(), actual.cols(), expected.rows(), expected.cols(), listener)) return false;
  if (actual.size() == 0) return true;
  const Eigen::ArrayXXd error = (actual - expected).array().abs();
  const auto off = (!(error <= tolerance)).count();  // counts NaN as off
  if (off == 0) return true;
  Eigen::Index i = 0, j = 0;
  (!(error <= tolerance))
      .select(error.isNaN().select(std::numeric_limits<double>::infinity(), error), -1)
      .maxCoeff(&i, &j);
  *listener << off << " of " << actual.size() << " entries are off; worst at (" << i << ", " << j
            << "): " << actual(i, j) << ", expected " << expected(i, j) << ", off by " << error(i, j);
  return false;
}

bool match_vertices(const Vertices& actual, const Vertices& expected, double tolerance,
                    ::testing::MatchResultListener* listener) {
  if (!same_size(actual.rows(), 3, expected.rows(), 3, listener)) return false;
  if (actual.rows() == 0) return true;
  Eigen::ArrayXd distance = (actual - expected).rowwise().norm();
  distance = distance.isNaN().select(std::numeric_limits<double>::infinity(), distance);
  Eigen::Index worst = 0;
  const double largest = distance.maxCoeff(&worst);
  if (largest <= tolerance) return true;
  const Eigen::IOFormat row_format(6, Eigen::DontAlignCols, " ", " ", "", "", "(", ")");
  *listener << (distance > tolerance).count() << " of " << actual.rows() << " vertices are off, rms "
            << std::sqrt(distance.square().mean()) << "; worst is row " << worst << ": "
            << actual.row(worst).format(row_format) << ", expected " << expected.row(worst).format(row_format) << ", "
            << largest << " away";
  return false;
}

}  // namespace facewright::testing_support
