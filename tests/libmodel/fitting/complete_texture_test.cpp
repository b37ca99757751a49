// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/complete_texture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/fitting/fit_model.h"
#include "libmodel/fitting/merge_textures.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/render_mesh.h"
#include "libmodel/render/sampling.h"
#include "tests/libmodel/fitting/toy_model.h"

namespace facewright {
namespace {

constexpr int kSize = 256;

/// The toy model with its left-right table: rows of 25 vertices each; optionally without colour.
MorphableModel symmetric_model(bool colour = true, bool mirror = true) {
  MorphableModelParts parts = toy_model().parts();
  if (mirror)
    for (int v = 0; v < 25 * 31; ++v) parts.mirror.push_back(v / 25 * 25 + 24 - v % 25);
  if (!colour) parts.colour = {};
  return MorphableModel(std::move(parts));
}

/// A pattern that is its own mirror image about u = 1/2, opaque.
Image symmetric_pattern() {
  Image image(kSize, kSize, 4, 255);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const double u = std::abs(x - (kSize - 1) / 2.0) / kSize, v = 6.28 * y / kSize;
      for (int k = 0; k < 3; ++k)
        image.pixel(x, y)[k] = static_cast<std::uint8_t>(140 + 50 * std::sin(30 * u + k) + 40 * std::cos((2 + k) * v));
    }
  return image;
}

/// Alpha falls from 1 to 0 over a few texels about column `edge`; `left` says which side stays.
Image half(Image image, int edge, bool left) {
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const double t = std::clamp(0.5 + (left ? edge - x : x - edge) / 16.0, 0.0, 1.0);
      image.pixel(x, y)[3] = static_cast<std::uint8_t>(std::lround(255 * t));
    }
  return image;
}

double worst_mean_difference(const Image& a, const Image& b, const Image& sources, TexelSource of) {
  double sum = 0;
  int count = 0;
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      if (texel_source(sources, x, y) != of) continue;
      for (int k = 0; k < 3; ++k, ++count) sum += std::abs(a.pixel(x, y)[k] - b.pixel(x, y)[k]);
    }
  return count > 0 ? sum / count : 0;
}

TEST(CompleteTexture, SymmetricFaceSeenFromOneSideIsCompletedToTheTruth) {
  const MorphableModel model = symmetric_model();
  const IsomapTexels texels = isomap_texels(model.mean(), kSize);
  const Image truth = symmetric_pattern();
  const CompletedTexture c = complete_texture(model, -1, half(truth, 150, true), texels);
  EXPECT_LT(worst_mean_difference(c.texture, truth, c.sources, TexelSource::seen), 0.5);
  EXPECT_LT(worst_mean_difference(c.texture, truth, c.sources, TexelSource::mirrored), 1.5);
  EXPECT_GT(c.summary.mirrored, 0.3);
  EXPECT_NEAR(c.summary.seen + c.summary.mirrored + c.summary.modelled, 1, 1e-9);
}

TEST(CompleteTexture, ShadedSideIsBrightenedToTheSeenOne) {  // a gain over the face: the mirror image follows it
  const MorphableModel model = symmetric_model();
  const IsomapTexels texels = isomap_texels(model.mean(), kSize);
  Image truth(kSize, kSize, 4, 255);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      for (int k = 0; k < 3; ++k)
        truth.pixel(x, y)[k] = static_cast<std::uint8_t>(x < 128 ? 100 : x < 140 ? 100 + 3 * (x - 128) : 136);
  const CompletedTexture c = complete_texture(model, -1, half(truth, 170, true), texels);
  int jump = 0;  // no step at the border of the seen
  for (int x = 150; x < 200; ++x)
    jump = std::max(jump, std::abs(c.texture.pixel(x, 128)[1] - c.texture.pixel(x + 1, 128)[1]));
  EXPECT_LE(jump, 3);
  EXPECT_GT(c.texture.pixel(185, 128)[1], 120);
}

TEST(CompleteTexture, EveryTexelSaysWhereItIsFrom) {
  const MorphableModel model = symmetric_model();
  const IsomapTexels texels = isomap_texels(model.mean(), kSize);
  const CompletedTexture c = complete_texture(model, -1, half(symmetric_pattern(), 60, true), texels);
  EXPECT_EQ(texel_source(c.sources, 40, 128), TexelSource::seen);
  EXPECT_EQ(texel_source(c.sources, 128, 128), TexelSource::modelled);
  EXPECT_EQ(texel_source(c.sources, 255 - 40, 128), TexelSource::mirrored);
  EXPECT_EQ(texel_source(c.sources, 0, 0), TexelSource::outside);
  EXPECT_EQ(c.texture.channels, 3);
}

TEST(CompleteTexture, NoColourNoMirrorStillGivesAWholeTextureAndSaysSo) {
  const MorphableModel model = symmetric_model(false, false);
  const IsomapTexels texels = isomap_texels(model.mean(), kSize);
  const CompletedTexture c = complete_texture(model, -1, half(symmetric_pattern(), 128, true), texels);
  EXPECT_FALSE(c.summary.has_mirror);
  EXPECT_FALSE(c.summary.has_colour_model);
  EXPECT_EQ(c.summary.mirrored, 0);
  EXPECT_GT(c.summary.modelled, 0.3);
  EXPECT_GT(c.texture.pixel(220, 128)[0], 30);
}

TEST(CompleteTexture, NothingSeenAndNoColourGivesNoTexture) {
  const MorphableModel model = symmetric_model(false, false);
  const IsomapTexels texels = isomap_texels(model.mean(), kSize);
  const CompletedTexture c = complete_texture(model, -1, Image(kSize, kSize, 4, 0), texels);
  EXPECT_TRUE(c.texture.empty());
  EXPECT_TRUE(c.sources.empty());
  EXPECT_EQ(c.summary.seen, 0);
}

TEST(CompleteTexture, SurroundingsContinueTheBorderSoThatFiltersFindNoSeam) {
  const MorphableModel model = symmetric_model();
  const IsomapTexels texels = isomap_texels(model.mean(), kSize);
  Image white(kSize, kSize, 4, 255);
  const CompletedTexture c = complete_texture(model, -1, white, texels);
  for (const auto byte : c.texture.data) EXPECT_GT(byte, 240);
}

TEST(CompleteTexture, RefusesWhatDoesNotFit) {
  const MorphableModel model = symmetric_model();
  const IsomapTexels texels = isomap_texels(model.mean(), kSize);
  EXPECT_THROW(complete_texture(model, -1, Image(64, 64, 4), texels), InvalidInput);
  EXPECT_THROW(complete_texture(model, -1, Image(kSize, kSize, 3), texels), InvalidInput);
  CompletionOptions options;
  options.adaptation_texels = 0;
  EXPECT_THROW(complete_texture(model, -1, symmetric_pattern(), texels, options), InvalidInput);
}

TEST(MergeTextures, TwoHalfViewsOfDifferentExposureGiveTheWhole) {
  const Image truth = symmetric_pattern();
  Image dark = truth;
  for (size_t i = 0; i < dark.data.size(); ++i)
    if (i % 4 < 3) dark.data[i] = srgb8_from_linear(0.6 * linear_from_srgb8(truth.data[i]));
  const MergedTexture m = merge_textures({half(truth, 150, true), half(dark, 106, false)});
  EXPECT_NEAR(m.summary.gains[1][0] / m.summary.gains[0][0], 1 / 0.6, 0.06);
  double scale = 0, worst = 0;  // the whole is right up to one exposure
  for (int x = 8; x < 248; ++x)
    scale += linear_from_srgb8(m.isomap.pixel(x, 100)[1]) / linear_from_srgb8(truth.pixel(x, 100)[1]) / 240;
  for (int x = 8; x < 248; ++x) {
    EXPECT_EQ(m.isomap.pixel(x, 100)[3], 255);
    worst = std::max(
        worst,
        std::abs(linear_from_srgb8(m.isomap.pixel(x, 100)[1]) / linear_from_srgb8(truth.pixel(x, 100)[1]) / scale - 1));
  }
  EXPECT_LT(worst, 0.06);
  EXPECT_NEAR(m.summary.shares[0] + m.summary.shares[1], 1, 1e-9);
}

TEST(MergeTextures, OneOutlierAmongThreeIsIgnored) {
  const Image truth = symmetric_pattern();
  Image hand = truth;  // something before the face in one of them
  for (int y = 100; y < 160; ++y)
    for (int x = 100; x < 160; ++x) hand.pixel(x, y)[0] = 20, hand.pixel(x, y)[1] = 250, hand.pixel(x, y)[2] = 20;
  const MergedTexture m = merge_textures({truth, hand, truth});
  for (int y = 105; y < 155; y += 5)
    for (int x = 105; x < 155; x += 5)
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(m.isomap.pixel(x, y)[k], truth.pixel(x, y)[k], 4);
  EXPECT_GT(m.summary.outlying, 0.005);
}

TEST(MergeTextures, SharperImageCountsMore) {
  Image a(kSize, kSize, 4, 255), b = a;
  for (size_t i = 0; i < a.data.size(); ++i)
    if (i % 4 < 3) a.data[i] = 100, b.data[i] = 140;
  MergeOptions options;
  options.compensate_gain = false;
  const MergedTexture m = merge_textures({a, b}, {1, 4}, options);
  EXPECT_GT(m.isomap.pixel(9, 9)[0], 135);
  EXPECT_NEAR(m.summary.shares[1], 16.0 / 17, 1e-6);
}

TEST(MergeTextures, RefusesNothingAndDifferentSizes) {
  EXPECT_THROW(merge_textures({}), InvalidInput);
  EXPECT_THROW(merge_textures({Image(8, 8, 4), Image(9, 8, 4)}), InvalidInput);
  EXPECT_THROW(merge_textures({Image(8, 8, 3)}), InvalidInput);
  EXPECT_EQ(merge_textures({Image(8, 8, 4)}).isomap.pixel(0, 0)[3], 0);  // nothing seen: nothing invented
}

TEST(ExtractTexture, PerspectiveRoundTripKeepsVisibleTexels) {
  const Mesh mesh = toy_model().mean();
  const Image texture = symmetric_pattern();
  PerspectiveCamera camera;
  camera.focal_px = 1300, camera.t = {0, 0, -350}, camera.principal = {400, 400};
  RenderOptions options;
  options.width = options.height = 800, options.shading = Shading::none;
  TextureOptions extraction;
  extraction.size = kSize;
  const TextureResult r = extract_texture(mesh, render_mesh(mesh, camera, options, texture), camera, extraction);
  double sum = 0;
  int count = 0;
  for (int y = 20; y < kSize - 20; ++y)
    for (int x = 20; x < kSize - 20; ++x) {
      if (r.isomap.pixel(x, y)[3] < 255) continue;
      for (int k = 0; k < 3; ++k, ++count) sum += std::pow(r.isomap.pixel(x, y)[k] - texture.pixel(x, y)[k], 2);
    }
  EXPECT_GT(count, 60000);
  EXPECT_GT(10 * std::log10(255.0 * 255 * count / sum), 38);
  EXPECT_GT(r.summary.resolution, 1);
}

TEST(FitModel, CompletedTextureHasNoHolesAndTheModelWithoutUvSaysNothing) {
  const MorphableModel model = symmetric_model();
  const Mesh truth = model.mean();
  const AffineCamera camera = frame_camera(truth.V, 500, 500, 0.5).affine();
  FitModelOptions options;
  options.texture.size = 128;
  const Image photo(500, 500, 3, 128);
  const FitModelResult r = fit_model(model, photo, project_landmarks(model, truth.V, camera), options);
  EXPECT_EQ(r.completed.texture.width, 128);
  EXPECT_GT(r.completed.summary.mirrored, 0);
  MorphableModelParts parts = toy_model().parts();
  parts.uv.resize(0, 2);
  const MorphableModel bare(std::move(parts));
  const FitModelResult none = fit_model(bare, photo, project_landmarks(bare, truth.V, camera), options);
  EXPECT_TRUE(none.completed.texture.empty());
  EXPECT_TRUE(none.texture.isomap.empty());
  EXPECT_EQ(none.frontal.width, 512);
}

}  // namespace
}  // namespace facewright
