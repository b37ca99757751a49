// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/linear_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/render/sampling.h"
#include "libmodel/render/srgb_encoder.h"

namespace facewright {
namespace {

Image noise(int width, int height, int channels) {
  Random random(5);
  Image image(width, height, channels);
  for (auto& byte : image.data) byte = static_cast<std::uint8_t>(random.index(256));
  return image;
}

TEST(SrgbEncoder, GivesTheByteOfTheExactFunctionAtEveryStepAndBesideEveryThreshold) {
  const SrgbEncoder& encode = SrgbEncoder::get();
  for (int i = -1000; i <= 300000; ++i) {
    const auto x = static_cast<float>(i / 299000.0);
    ASSERT_EQ(encode(x), srgb8_from_linear(double{x})) << x;
  }
  for (int code = 0; code < 255; ++code) {
    auto x = static_cast<float>(linear_from_srgb((code + 0.5) / 255));
    for (int k = 0; k < 20; ++k) x = std::nextafter(x, 0.0F);
    for (int k = 0; k < 40; ++k, x = std::nextafter(x, 2.0F)) ASSERT_EQ(encode(x), srgb8_from_linear(double{x}));
  }
  EXPECT_EQ(encode(std::numeric_limits<float>::quiet_NaN()), 0);
  EXPECT_EQ(encode(std::numeric_limits<float>::infinity()), 255);
}

TEST(LinearImage, AgreesWithThePlainBilinearSample) {
  Random random(1);
  for (const int channels : {1, 3, 4}) {
    const Image image = noise(31, 17, channels);
    const LinearImage linear(image);
    for (int i = 0; i < 500; ++i) {
      const double x = random.uniform(-3, 34), y = random.uniform(-3, 20);
      const Eigen::Vector4d expected = sample_rgba(image, {x, y});
      const Rgba c = linear.sample(static_cast<float>(x), static_cast<float>(y));
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(c[k], expected[k] * expected[3], 2e-5);
      EXPECT_NEAR(c[3], expected[3], 2e-5);
    }
  }
}

TEST(LinearImage, PartAgreesWithTheWholeInside) {
  const Image image = noise(64, 64, 3);
  const LinearImage whole(image), part(image, 3, 16, 8, 48, 56);
  for (int level = 0; level < 3; ++level)
    for (float x = 22; x < 40; x += 0.7F)
      EXPECT_LT((whole.sample(x, 30.3F, level) - part.sample(x, 30.3F, level)).abs().maxCoeff(), 1e-5F);
}

TEST(LinearImage, EveryLevelKeepsTheMeanAndTheLastIsOnePixel) {
  const LinearImage linear(noise(64, 32, 3));
  ASSERT_EQ(linear.levels(), 7);
  Rgba mean = Rgba::Zero();
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x) mean += linear.sample(static_cast<float>(x), static_cast<float>(y)) / (64 * 32);
  EXPECT_LT((linear.sample(10, 10, 6) - mean).abs().maxCoeff(), 1e-4F);
}

TEST(LinearImage, NoPositionReadsOutside) {  // the sanitizer watches
  for (const auto& [width, height] : {std::pair{1, 1}, std::pair{1, 7}, std::pair{5, 3}}) {
    const LinearImage linear(noise(width, height, 4));
    for (const float p : {-1e30F, -1.0F, 0.0F, 0.999F, 4.0F, 1e30F, std::numeric_limits<float>::infinity(),
                          std::numeric_limits<float>::quiet_NaN()})
      for (int level = 0; level < linear.levels(); ++level) {
        EXPECT_TRUE(linear.sample(p, 0, level).isFinite().all());
        EXPECT_TRUE(linear.sample(0, p, level).isFinite().all());
        const Float4 c = linear.trilinear(p, p, p);
        EXPECT_TRUE(std::isfinite(c[0]));
      }
  }
  EXPECT_THROW(LinearImage{Image()}, InvalidInput);
}

}  // namespace
}  // namespace facewright
