// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/framing.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/render/head_pose.h"

namespace facewright {
namespace {

TEST(HeadPose, AnglesSurviveTheRotationMatrix) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const HeadPose pose{random.uniform(-3, 3), random.uniform(-1.5, 1.5), random.uniform(-3, 3)};
    const HeadPose back = head_pose(rotation(pose));
    EXPECT_NEAR(back.yaw, pose.yaw, 1e-9);
    EXPECT_NEAR(back.pitch, pose.pitch, 1e-9);
    EXPECT_NEAR(back.roll, pose.roll, 1e-9);
  }
}

TEST(HeadPose, SignsMeanWhatTheirNamesSay) {
  const Eigen::Vector3d nose(0, 0, 1), crown(0, 1, 0);
  EXPECT_GT((rotation({0.3, 0, 0}) * nose)[0], 0);   // looks to the subject's left, right in the image
  EXPECT_LT((rotation({0, 0.3, 0}) * nose)[1], 0);   // looks down
  EXPECT_LT((rotation({0, 0, 0.3}) * crown)[0], 0);  // tilts to the subject's right
}

TEST(HeadPose, GimbalLockStillGivesTheRotation) {
  const Eigen::Matrix3d R = rotation({0.4, 1.5707963267948966, 0.2});
  EXPECT_LT((rotation(head_pose(R)) - R).norm(), 1e-6);
}

TEST(FrameCamera, ShowsEverythingCentredWithAMargin) {
  Random random(2);
  const Vertices V = Vertices::NullaryExpr(100, 3, [&] { return 80 * random.normal(); });
  for (const auto& [width, height] : {std::pair{100, 100}, std::pair{300, 80}, std::pair{40, 200}}) {
    const AffineCamera camera = frame_camera(V, width, height, 0.5, -0.2).affine();
    const TexCoords p = (V * camera.A.transpose()).rowwise() + camera.b.transpose();
    const Eigen::RowVector2d low = p.colwise().minCoeff(), high = p.colwise().maxCoeff();
    EXPECT_NEAR(low[0] + high[0], width - 1, 1e-9);
    EXPECT_NEAR(low[1] + high[1], height - 1, 1e-9);
    EXPECT_NEAR(std::max((high - low)[0] / width, (high - low)[1] / height), 0.9, 1e-9);
  }
  EXPECT_THROW(frame_camera(Vertices(), 10, 10), InvalidInput);
}

TEST(ContactSheet, TilesRowByRowOnWhite) {
  const Image sheet = contact_sheet({Image(2, 2, 3, 10), Image(4, 3, 1, 20), Image(4, 3, 4, 0)}, 2);
  EXPECT_EQ(sheet.width, 8);
  EXPECT_EQ(sheet.height, 6);
  EXPECT_EQ(sheet.pixel(1, 0)[0], 10);
  EXPECT_EQ(sheet.pixel(0, 0)[0], 255);
  EXPECT_EQ(sheet.pixel(4, 0)[2], 20);
  EXPECT_EQ(sheet.pixel(0, 3)[0], 255);  // transparent over white
  EXPECT_EQ(sheet.pixel(7, 5)[0], 255);  // empty cell
  EXPECT_THROW(contact_sheet({}, 2), InvalidInput);
}

}  // namespace
}  // namespace facewright
