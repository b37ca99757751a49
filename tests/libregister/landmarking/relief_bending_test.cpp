// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/relief_bending.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libregister/landmarking/landmark_checks.h"
#include "libregister/landmarking/relief_pose.h"
#include "libregister/reference/reference_face.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

// Someone whose face is wider and lower than the reference's, with a rounder forehead.
Vertices other_face(const Vertices& V) {
  Vertices W = V;
  W.col(0) *= 1.06;
  W.col(1) *= 0.95;
  for (Eigen::Index i = 0; i < W.rows(); ++i)
    W(i, 2) += 4 * std::exp(-(W.row(i) - Eigen::RowVector3d(0, 80, 60)).squaredNorm() / 3000);
  return W;
}

class ReliefBendingTest : public ::testing::Test {
 protected:
  ReliefBendingTest() {
    const Mesh base = reference_.level_mesh(0);
    marks_ = locate(reference_.landmarks, base.V, base.F);
    truth_ = locate(reference_.landmarks, other_face(base.V), base.F);
    view_.centre = (marks_.at("28").position + marks_.at("58").position) / 2;
    Random random(8);
    planted_ = {1.05, random_rotation(random),
                200 * Eigen::Vector3d(random.normal(), random.normal(), random.normal())};
    scan_ = reference_.level_mesh(3);
    scan_.V = planted_.apply(other_face(scan_.V));
  }
  ReliefBending bending() const { return {scan_, fine_, coarse_, marks_, view_}; }
  // The planted pose after a shift in the head's frame, in mm.
  Similarity shifted(double x, double y) const {
    Similarity S = planted_;
    S.t += S.s * S.R * Eigen::Vector3d(x, y, 0);
    return S;
  }
  double error(const Landmarks& found) const {
    double squares = 0, n = 0;
    for (const auto& [name, mark] : truth_) {
      const auto it = found.find(name);
      if (is_jaw_landmark(name) || it == found.end()) continue;
      squares += (it->second.position - planted_ * mark.position).squaredNorm() / (planted_.s * planted_.s), ++n;
    }
    EXPECT_GT(n, 50);
    return std::sqrt(squares / n);
  }

  const MultiresTemplate reference_ = default_reference();
  const MultiresTemplate coarse_ = coarse_levels(reference_, 2);
  const Mesh fine_ = reference_.level_mesh(2);
  Landmarks marks_, truth_;
  FaceViewOptions view_;
  Similarity planted_;
  Mesh scan_;
};

TEST_F(ReliefBendingTest, FindsTheFeaturesFromPosesThatLieOnOthers) {
  for (const double y : {0.0, -20.0, 18.0}) {  // nose on nose, on lip, on bridge
    const ReliefStart start = bending().start(shifted(2, y));
    EXPECT_GT(start.likeness, 0.8) << y;
    int views = 0;
    EXPECT_LT(error(bending().finish(start, &views)), 2.5) << y;
    EXPECT_EQ(views, 6);
  }
}

TEST_F(ReliefBendingTest, RightPosesHaveMoreMeritThanTwistedOnes) {
  Similarity large = shifted(0, -25);
  large.s *= 1.25;
  Mesh smooth = scan_;
  smooth.V = planted_.apply(icosphere(5, 100).V);
  smooth.F = icosphere(5, 100).F;
  const double right = bending().start(planted_).merit;
  EXPECT_GE(right, bending().start(large).merit);
  EXPECT_GT(right, ReliefBending(smooth, fine_, coarse_, marks_, view_).start(planted_).merit + 0.3);
}

TEST_F(ReliefBendingTest, WhereNothingIsSeenThereIsNoMeritAndNoLandmark) {
  const ReliefStart start = bending().start(shifted(3000, 0));
  EXPECT_EQ(start.likeness, -1);
  EXPECT_TRUE(std::isinf(start.merit));
  int views = 0;
  EXPECT_THROW(bending().finish(start, &views), InvalidInput);
}

TEST_F(ReliefBendingTest, AFaceIsLikeItself) {
  EXPECT_NEAR(relief_likeness(scan_, scan_, planted_, view_), 1, 1e-6);
  EXPECT_LT(relief_likeness(scan_, {shifted(0, 25).apply(other_face(fine_.V)), fine_.F, {}, {}, {}}, planted_, view_),
            0.8);
}

}  // namespace
}  // namespace facewright
