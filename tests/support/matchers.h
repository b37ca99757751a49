// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <gmock/gmock.h>

#include <Eigen/Core>

#include "libmodel/core/mesh.h"

// Matchers that say what differs, where, and by how much. They take matrices by value of their expression:
//   EXPECT_THAT(R.transpose() * R, MatrixNear(Eigen::Matrix3d::Identity(), 1e-12));
//   EXPECT_THAT(result.V, VerticesNear(expected, 0.01));
namespace facewright {

namespace testing_support {

/// Dynamic copies, so that one compiled matcher serves every matrix type.
bool match_matrix(const Eigen::MatrixXd& actual, const Eigen::MatrixXd& expected, double tolerance,
                  ::testing::MatchResultListener* listener);
bool match_vertices(const Vertices& actual, const Vertices& expected, double tolerance,
                    ::testing::MatchResultListener* listener);

}  // namespace testing_support

/// Every entry within `tolerance`; names the worst entry and how many are off.
MATCHER_P2(MatrixNear, expected, tolerance,
           "is within " + ::testing::PrintToString(tolerance) + " of the expected matrix") {
  return testing_support::match_matrix(Eigen::MatrixXd(arg.template cast<double>()), expected, tolerance,
                                       result_listener);
}

/// Every vertex within the distance `tolerance` (mm); names the worst row, and tells rms and share of rows off.
MATCHER_P2(VerticesNear, expected, tolerance,
           "has every vertex within " + ::testing::PrintToString(tolerance) + " mm of its expected place") {
  return testing_support::match_vertices(Vertices(arg), expected, tolerance, result_listener);
}

/// A proper rotation to `tolerance`: orthonormal, determinant +1.
MATCHER_P(IsRotation, tolerance, "is a rotation within " + ::testing::PrintToString(tolerance)) {
  const Eigen::Matrix3d R = arg;
  if (R.determinant() < 0) {
    *result_listener << "a reflection, determinant " << R.determinant();
    return false;
  }
  return testing_support::match_matrix(R.transpose() * R, Eigen::Matrix3d::Identity(), tolerance, result_listener);
}

/// Arrays or meshes with the very same bytes (determinism).
MATCHER_P(SameBytes, expected, "has exactly the expected values") {
  if (arg.rows() != expected.rows() || arg.cols() != expected.cols()) {
    *result_listener << "sizes differ: " << arg.rows() << " x " << arg.cols() << " against " << expected.rows() << " x "
                     << expected.cols();
    return false;
  }
  const auto count = (arg.array() != expected.array()).count();
  if (count > 0) *result_listener << count << " of " << arg.size() << " values differ";
  return count == 0;
}

}  // namespace facewright
