// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/image_landmarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "libmodel/core/errors.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/render_mesh.h"
#include "libmodel/synthetic/appearance.h"
#include "libmodel/synthetic/canonical_mesh.h"
#include "libmodel/synthetic/mean_head.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

constexpr int kSize = 640;

// A picture of the mean head from the front, and the camera it was taken with.
const std::pair<Image, OrthographicCamera>& portrait() {
  static const auto made = [] {
    Mesh head = extract_mean_head({.fine_spacing = 2}).mesh;
    const SkinPainter paint{Appearance{}};
    head.colours.resize(head.V.rows(), 3);
    for (Eigen::Index i = 0; i < head.V.rows(); ++i) head.colours.row(i) = paint(head.V.row(i).transpose()).transpose();
    const OrthographicCamera camera = frame_camera(head.V, kSize, kSize);
    return std::pair(render_mesh(head, camera, {.width = kSize, .height = kSize}), camera);
  }();
  return made;
}

class FaceDetectorTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!FaceDetector::available()) GTEST_SKIP() << "built without dlib";
    if (!std::filesystem::exists(FaceDetector::default_predictor()))
      GTEST_SKIP() << "no " << FaceDetector::default_predictor() << "; Debian's libdlib-data installs it";
  }
};

TEST_F(FaceDetectorTest, FindsTheFaceAndItsLandmarks) {
  FaceDetector detector;
  const auto& [image, camera] = portrait();
  const std::vector<DetectedFace> faces = detector.detect(image);
  ASSERT_EQ(faces.size(), 1u);
  ASSERT_EQ(faces[0].landmarks.size(), 68u);
  const Landmarks truth = mean_head_landmarks();
  const auto pixel = [&, &camera = camera](const char* name) {
    return camera.affine().project(truth.at(name).position);
  };
  const double eyes = (pixel("37") - pixel("46")).norm();
  // Annotators' and our definitions differ by some millimetres; a swapped or lost point is off by far more.
  for (const char* name : {"31", "37", "40", "43", "46", "49", "55"})
    EXPECT_LT((faces[0].landmarks.at(name).position - pixel(name)).norm(), 0.12 * eyes) << name;
}

TEST_F(FaceDetectorTest, ACopyFindsTheSame) {
  FaceDetector detector, other = detector.copy();
  const Image& image = portrait().first;
  const auto first = detector.detect(image), again = other.detect(image);
  ASSERT_EQ(first.size(), again.size());
  for (const auto& [name, point] : first.at(0).landmarks)
    EXPECT_EQ(point.position, again.at(0).landmarks.at(name).position);
}

TEST_F(FaceDetectorTest, NoFaceIsNoError) {
  FaceDetector detector;
  EXPECT_TRUE(detector.detect(Image(200, 150, 3, 128)).empty());
  EXPECT_THROW(detector.detect(Image()), InvalidInput);
}

TEST_F(FaceDetectorTest, AFileThatIsNoPredictorIsNamed) {
  const TemporaryDirectory folder;
  const std::string file = (folder / "trees.dat").string();
  std::ofstream(file) << "no trees";
  EXPECT_THAT([&] { FaceDetector detector(file); }, ThrowsMessage<IoError>(::testing::HasSubstr("trees.dat")));
  EXPECT_THAT([&] { FaceDetector detector(folder / "none.dat"); },
              ThrowsMessage<IoError>(::testing::HasSubstr("libdlib-data")));
}

TEST(FaceDetector, WithoutDlibTheErrorSaysWhatToDo) {
  if (FaceDetector::available()) GTEST_SKIP() << "built with dlib";
  EXPECT_THAT([] { FaceDetector detector; }, ThrowsMessage<InvalidInput>(::testing::HasSubstr("libdlib-dev")));
}

}  // namespace
}  // namespace facewright
