// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/io/markup.h"
#include "pipelines/model_pictures.h"
#include "pipelines/viewer/page.h"
#include "pipelines/viewer/viewer_data.h"
#include "tests/libmodel/fitting/toy_model.h"

namespace facewright {
namespace {

TEST(Page, TextAndLinksAreEscaped) {
  EXPECT_EQ(markup_text("a<b>&\"c'"), "a&lt;b&gt;&amp;&quot;c&apos;");
  EXPECT_EQ(html_link("a b%<\xc3\xa9.png"), "a%20b%25%3C\xc3\xa9.png");
}

TEST(Page, IsOneFileThatAsksForNothing) {
  Page page;
  page.title = "a <b>";
  page.body = "<p>words</p>";
  const std::string html = page_html(page);
  EXPECT_EQ(html.rfind("<!DOCTYPE html>", 0), 0u);
  EXPECT_NE(html.find("<title>a &lt;b&gt;</title>"), html.npos);
  EXPECT_NE(html.find("default-src 'none'"), html.npos);
  EXPECT_NE(html.find("<p>words</p>"), html.npos);
  EXPECT_EQ(html.find(" src=\"http"), html.npos);
  EXPECT_EQ(html.find("<link rel=stylesheet"), html.npos);
}

TEST(Page, PicturesAreHalvedInLinearLight) {
  Image image(2, 2, 3, 0);
  for (int k = 0; k < 3; ++k) image.pixel(0, 0)[k] = image.pixel(1, 1)[k] = 255;
  const Image half = halved(image);
  ASSERT_EQ(half.width, 1);
  ASSERT_EQ(half.height, 1);
  EXPECT_EQ(half.pixel(0, 0)[0], 188);  // half the light, by IEC 61966-2-1
  Image clear(2, 2, 4, 255);
  clear.pixel(0, 0)[3] = clear.pixel(1, 0)[3] = 0;
  EXPECT_EQ(halved(clear).pixel(0, 0)[3], 128);
}

TEST(ViewerData, IsTheSameEveryTime) {
  const MorphableModel model = toy_model();
  const std::string data = model_viewer_data(model);
  EXPECT_EQ(data, model_viewer_data(model));
  EXPECT_EQ(data.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/="), data.npos);
  EXPECT_EQ(data.rfind("H4sI", 0), 0u);  // what a gzip stream starts with
  EXPECT_LT(model_viewer_data(model, {.shape_modes = 0, .colour_modes = 0}).size(), data.size());
  EXPECT_THROW(model_viewer_data(MorphableModel()), InvalidInput);
}

TEST(ViewerData, RefusesWedgeCoordinates) {
  Mesh mesh = toy_model().mean();
  EXPECT_NO_THROW(mesh_viewer_data(mesh));
  mesh.uv = TexCoords::Zero(3, 2);
  mesh.uv_faces = Faces::Zero(mesh.F.rows(), 3);
  EXPECT_THROW(mesh_viewer_data(mesh), InvalidInput);
}

TEST(ModelPictures, HaveTheSameBytesForAnyNumberOfThreads) {
  const MorphableModel model = toy_model();
  const ModelPictureOptions one{.tile = 64, .threads = 1}, three{.tile = 64, .threads = 3};
  EXPECT_EQ(mean_picture(model, one).data, mean_picture(model, three).data);
  EXPECT_EQ(mode_picture(model, {.faces = one}).data, mode_picture(model, {.faces = three}).data);
  EXPECT_EQ(sample_picture(model, 7, 1, 3, one).data, sample_picture(model, 7, 1, 3, three).data);
  EXPECT_EQ(deviation_picture(model, 0, one).data, deviation_picture(model, 0, three).data);
}

TEST(ModelPictures, ModesAreARowEachWithThreeFacesPerView) {
  const MorphableModel model = toy_model();
  const int modes = static_cast<int>(std::min<Eigen::Index>(4, model.shape().mode_count()));
  const Image sheet = mode_picture(model, {.faces = {.tile = 60, .yaws_deg = {0, 40}}, .modes = 4});
  EXPECT_EQ(sheet.width, 6 * 60);
  EXPECT_EQ(sheet.height % modes, 0);
  EXPECT_GT(sheet.height / modes, 60);
  // The middle face of each view is the mean, the outer ones are not.
  const auto tile = [&](int column) {
    std::vector<std::uint8_t> bytes;
    for (int y = sheet.height / modes - 60; y < sheet.height / modes; ++y)
      bytes.insert(bytes.end(), sheet.pixel(60 * column, y), sheet.pixel(60 * column, y) + 3 * 60);
    return bytes;
  };
  const Image mean = mean_picture(model, {.tile = 60, .yaws_deg = {0}});
  const std::vector<std::uint8_t> clay(mean.pixel(0, mean.height - 60), mean.pixel(0, mean.height - 60) + 3 * 60 * 60);
  EXPECT_EQ(tile(1), clay);
  EXPECT_NE(tile(0), clay);
  EXPECT_NE(tile(2), clay);
}

TEST(ModelPictures, ATurnComesBack) {
  const Mesh mesh = toy_model().mean();
  const std::vector<Image> frames = turntable(mesh, 4, {.tile = 80});
  ASSERT_EQ(frames.size(), 4u);
  EXPECT_NE(frames[0].data, frames[1].data);
  EXPECT_NE(frames[1].data, frames[3].data);
  EXPECT_EQ(frames[0].data, turntable(mesh, 1, {.tile = 80})[0].data);
}

TEST(ModelPictures, RefuseWhatTheyCannotShow) {
  const MorphableModel model = toy_model();
  EXPECT_THROW(mean_picture(MorphableModel()), InvalidInput);
  EXPECT_THROW(mean_picture(model, {.tile = 8}), InvalidInput);
  EXPECT_THROW(mean_picture(model, {.level = model.level_count()}), InvalidInput);
  EXPECT_THROW(mode_picture(model, {.modes = 0}), InvalidInput);
  EXPECT_THROW(sample_picture(model, 0, 1, 1), InvalidInput);
  EXPECT_THROW(turntable(model.mean(), 0), InvalidInput);
  MorphableModelParts parts = model.parts();
  parts.uv.resize(0, 2);
  EXPECT_THROW(texture_map_picture(MorphableModel(parts)), InvalidInput);
  parts.colour = {};
  EXPECT_THROW(mode_picture(MorphableModel(parts), {.family = ModeFamily::colour}), InvalidInput);
}

}  // namespace
}  // namespace facewright
