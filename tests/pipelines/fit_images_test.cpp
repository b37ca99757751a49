// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/fit_images/fit_images.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/model/model_file.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/render_mesh.h"
#include "pipelines/fit_images/fit_person.h"
#include "pipelines/fit_images/image_list.h"
#include "tests/libmodel/fitting/toy_model.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class FitImagesTest : public ::testing::Test {
 protected:
  // A picture NAME.png of a random face with NAME.pts beside it.
  void take_picture(const std::string& name, std::uint64_t seed) {
    Random random(seed);
    const Mesh face = model_.sample(random);
    const OrthographicCamera camera = frame_camera(face.V, 160, 160, 0.2);
    write_png(folder_ / (name + ".png"), render_mesh(face, camera, {.width = 160, .height = 160}));
    ImageLandmarks landmarks = project_landmarks(model_, face.V, camera.affine());
    write_image_landmarks(folder_ / (name + ".json"), landmarks);
  }

  // The same person from another side, by a pinhole camera 350 mm away.
  PerspectiveCamera take_close_up(const std::string& name, const Mesh& face, double yaw) {
    PerspectiveCamera camera;
    camera.R = rotation({yaw, 0.05, 0});
    camera.t = {3, -4, -350};
    camera.focal_px = 260;
    camera.principal = {79.5, 79.5};
    write_png(folder_ / (name + ".png"),
              render_mesh(face, camera, {.width = 160, .height = 160, .shading = Shading::none}));
    ImageLandmarks landmarks;
    for (const auto& [mark, place] : model_.landmarks())
      landmarks[mark].position = camera.project(face.V.row(place.vertex).transpose());
    write_image_landmarks(folder_ / (name + ".json"), landmarks);
    return camera;
  }

  // The model without texture coordinates and colours.
  void make_plain() {
    MorphableModelParts parts = model_.parts();
    parts.uv.resize(0, 2);
    parts.colour = {};
    model_ = MorphableModel(parts);
  }

  FitImagesOptions options() {
    save_model(folder_ / "model.h5", model_);
    FitImagesOptions o;
    o.model = folder_ / "model.h5";
    o.images = list_images({(folder_ / "frame_%02d.png").string()});
    o.output = folder_ / "out";
    o.fit.texture.size = 32;
    o.fit.frontal_size = 32;
    return o;
  }

  std::string file(const std::string& name) { return read_file(folder_ / name); }

  TemporaryDirectory folder_;
  MorphableModel model_ = toy_model();
};

std::vector<std::string> names(const std::vector<fs::path>& files) {
  std::vector<std::string> result;
  for (const fs::path& f : files) result.push_back(f.filename().string());
  return result;
}

TEST(ListImages, NumbersCountAsNumbersAndPatternsMeanSequences) {
  const TemporaryDirectory folder;
  for (const char* name : {"f_10.png", "f_2.png", "f_002b.png", "g.JPG", "f_2.pts", "f_x.png"})
    write_file(folder / name, "x");
  EXPECT_THAT(names(list_images({(folder / "f_%d.png").string()})), ::testing::ElementsAre("f_2.png", "f_10.png"));
  EXPECT_THAT(names(list_images({(folder / "f_%02d.png").string()})), ::testing::ElementsAre("f_10.png"));
  EXPECT_THAT(names(list_images({folder.path().string()})),
              ::testing::ElementsAre("f_2.png", "f_002b.png", "f_10.png", "f_x.png", "g.JPG"));
}

TEST(ListImages, SaysWhatIsNotThere) {
  const TemporaryDirectory folder;
  const auto message = [&](const std::string& name) { return [&, name] { list_images({(folder / name).string()}); }; };
  EXPECT_THAT(message("none.png"), ThrowsMessage<InvalidInput>(HasSubstr("none.png")));
  EXPECT_THAT(message("f_%d.png"), ThrowsMessage<InvalidInput>(HasSubstr("no file of this form")));
  EXPECT_THAT(message(""), ThrowsMessage<InvalidInput>(HasSubstr("no picture")));
  write_file(folder / "a/x.png", "x");
  write_file(folder / "b/x.jpg", "x");
  EXPECT_THAT(
      [&] {
        list_images({(folder / "a").string(), (folder / "b").string()});
      },
      ThrowsMessage<InvalidInput>(HasSubstr("same stem")));
}

TEST_F(FitImagesTest, WritesALineAndTheFilesOfEveryImage) {
  take_picture("frame_01", 1);
  take_picture("frame_02", 2);
  const FitImagesSummary summary = fit_images(options());
  EXPECT_EQ(summary.fitted, 2);
  for (const char* ending :
       {".obj", ".mtl", ".glb", ".json", "_isomap.png", "_texture.png", "_sources.png", "_frontal.png", "_overlay.png"})
    EXPECT_TRUE(fs::exists(folder_ / "out" / ("frame_02" + std::string(ending)))) << ending;
  const auto json = nlohmann::json::parse(file("out/frame_01.json"));
  EXPECT_EQ(json["shape_coefficients"].size(), static_cast<size_t>(model_.shape().mode_count()));
  std::istringstream csv(file("out/fits.csv"));
  std::string header, first;
  std::getline(csv, header);
  std::getline(csv, first);
  EXPECT_EQ(std::count(header.begin(), header.end(), ','), std::count(first.begin(), first.end(), ','));
  EXPECT_TRUE(first.starts_with("frame_01.png,frame_01.json,yes,"));
}

TEST_F(FitImagesTest, AFailureIsListedAndTheOthersAreAsWithoutIt) {
  take_picture("frame_01", 1);
  fit_images(options());
  const std::string alone = file("out/frame_01.json"), glb = file("out/frame_01.glb");
  write_file(folder_ / "frame_02.png", "no picture");
  write_file(folder_ / "frame_02.json", file("frame_01.json"));
  take_picture("frame_03", 3);
  fs::remove(folder_ / "frame_03.json");
  const FitImagesSummary summary = fit_images(options());
  EXPECT_EQ(summary.fitted, 1);
  EXPECT_EQ(summary.failed, 2);
  EXPECT_THAT(file("out/problematic/frame_02.txt"), HasSubstr("frame_02.png"));
  EXPECT_THAT(file("out/problematic/frame_03.txt"), HasSubstr("--landmarks"));
  EXPECT_THAT(file("out/fits.csv"), HasSubstr("frame_02.png,frame_02.json,no,"));
  EXPECT_EQ(file("out/frame_01.json"), alone);
  EXPECT_EQ(file("out/frame_01.glb"), glb);
}

TEST_F(FitImagesTest, TheFolderOfTheImagesIsNoPlaceForResults) {
  take_picture("frame_01", 1);
  FitImagesOptions o = options();
  const std::string before = file("frame_01.json");
  o.output = folder_ / ".";
  EXPECT_THROW(fit_images(o), InvalidInput);
  EXPECT_EQ(file("frame_01.json"), before);
}

TEST_F(FitImagesTest, NothingOfAnEarlierRunIsLeftBesideAFailure) {
  take_picture("frame_01", 1);
  take_picture("frame_02", 2);
  const FitImagesOptions o = options();
  ASSERT_EQ(fit_images(o).failed, 0);
  ASSERT_TRUE(fs::exists(o.output / "frame_01.obj"));
  write_file(folder_ / "frame_01.json", "{}");
  EXPECT_EQ(fit_images(o).failed, 1);
  for (const char* ending : {".obj", ".glb", ".json", "_overlay.png"})
    EXPECT_FALSE(fs::exists(o.output / (std::string("frame_01") + ending))) << ending;
}

TEST_F(FitImagesTest, BytesDoNotDependOnThreads) {
  for (int i = 1; i <= 3; ++i) take_picture("frame_0" + std::to_string(i), static_cast<std::uint64_t>(i));
  FitImagesOptions o = options();
  o.jobs = 1;
  fit_images(o);
  o.jobs = 3;
  o.output = folder_ / "out3";
  fit_images(o);
  for (const auto& entry : fs::directory_iterator(folder_ / "out")) {
    const std::string name = entry.path().filename().string();
    EXPECT_EQ(file("out/" + name), file("out3/" + name)) << name;
  }
}

TEST_F(FitImagesTest, ImagesWithoutLandmarksAreSearched) {
  take_picture("frame_01", 1);
  FitImagesOptions o = options();
  const ImageLandmarks landmarks = read_image_landmarks(folder_ / "frame_01.json");
  fs::remove(folder_ / "frame_01.json");
  o.finder = [&](const Image& image) {
    EXPECT_EQ(image.width, 160);
    return landmarks;
  };
  const FitImagesSummary summary = fit_images(o);
  EXPECT_TRUE(summary.images.at(0).landmarks.empty());
  EXPECT_THAT(file("out/frame_01.json"), HasSubstr("found in the image"));
}

TEST_F(FitImagesTest, WrongCallsAreRefusedBeforeAnythingIsWritten) {
  take_picture("frame_01", 1);
  FitImagesOptions o = options();
  o.landmarks = {"a.pts", "b.pts"};
  EXPECT_THROW(fit_images(o), InvalidInput);
  o = options();
  o.fit.level = 7;
  EXPECT_THROW(fit_images(o), InvalidInput);
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

// Mean difference of colours where the isomap shows what was seen, 0..255.
double colour_error(const Image& isomap, const Image& truth) {
  double sum = 0;
  int count = 0;
  for (int y = 0; y < isomap.height; ++y)
    for (int x = 0; x < isomap.width; ++x) {
      if (isomap.pixel(x, y)[3] < 200 || truth.pixel(x, y)[3] < 200) continue;
      for (int k = 0; k < 3; ++k) sum += std::abs(isomap.pixel(x, y)[k] - truth.pixel(x, y)[k]);
      count += 3;
    }
  return sum / std::max(count, 1);
}

TEST_F(FitImagesTest, CloseUpsAreFittedInPerspectiveAndTextureThroughThatCamera) {
  const Mesh face = model_.mean();
  const PerspectiveCamera truth = take_close_up("frame_01", face, 0.2);
  FitImagesOptions o = options();
  o.fit.fit.jaw = JawMode::fixed;
  o.perspective = true;
  o.focal_px = 260;
  const FitImagesSummary summary = fit_images(o);
  ASSERT_TRUE(summary.images.at(0).perspective);
  EXPECT_NEAR(summary.images[0].perspective->summary.distance_mm, 350, 60);  // the face's middle lies before the origin
  const auto json = nlohmann::json::parse(file("out/frame_01.json"));
  EXPECT_EQ(json["camera"]["kind"], "perspective");
  EXPECT_EQ(json["camera"]["focal_length"], "given");
  EXPECT_EQ(json["camera"]["focal_px"], 260);
  EXPECT_LT(json["landmark_rms_px"], 0.5);
  const Image expected =
      extract_texture(face, read_image(folder_ / "frame_01.png"), truth, {.size = o.fit.texture.size}).isomap;
  EXPECT_LT(colour_error(read_image(folder_ / "out/frame_01_isomap.png"), expected), 3);
  EXPECT_THAT(file("out/fits.csv"), HasSubstr(",260,given,"));
}

TEST_F(FitImagesTest, AFocalLengthThatIsNotGivenIsEstimatedAndMarkedSo) {
  take_close_up("frame_01", model_.mean(), 0.3);
  FitImagesOptions o = options();
  o.perspective = true;
  fit_images(o);
  const auto json = nlohmann::json::parse(file("out/frame_01.json"));
  EXPECT_THAT(json["camera"]["focal_length"].get<std::string>(), HasSubstr("estimated"));
  EXPECT_GT(json["camera"]["focal_log_stddev"], 0);
}

TEST_F(FitImagesTest, CamerasRefuseWhatIsNotTheirs) {
  take_picture("frame_01", 1);
  FitImagesOptions o = options();
  o.focal_px = 500;
  EXPECT_THAT([&] { fit_images(o); }, ThrowsMessage<InvalidInput>(HasSubstr("perspective")));
  o.perspective = true;
  o.fit.fit.jaw = JawMode::contour;
  EXPECT_THAT([&] { fit_images(o); }, ThrowsMessage<InvalidInput>(HasSubstr("outlines")));
  o.fit.fit.jaw = JawMode::slide;
  EXPECT_THAT([&] { fit_person(o); }, ThrowsMessage<InvalidInput>(HasSubstr("one person")));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

class FitPersonTest : public FitImagesTest {
 protected:
  // Three pictures of one random face; returns its coefficients.
  Eigen::VectorXd take_pictures() {
    Random random(5);
    const Eigen::VectorXd c = model_.shape().draw_coefficients(random);
    const Mesh face = model_.instance(c);
    int i = 0;
    for (const double yaw : {-0.5, 0.0, 0.5}) {
      const std::string name = "frame_0" + std::to_string(++i);
      const OrthographicCamera camera = frame_camera(face.V, 160, 160, yaw);
      write_png(folder_ / (name + ".png"), render_mesh(face, camera, {.width = 160, .height = 160}));
      write_image_landmarks(folder_ / (name + ".json"), project_landmarks(model_, face.V, camera.affine()));
    }
    return c;
  }
  FitImagesOptions person_options() {
    FitImagesOptions o = options();
    o.fit.fit.jaw = JawMode::fixed;
    o.fit.fit.sigma_mm = 0.01;
    return o;
  }
};

TEST_F(FitPersonTest, OneShapeAndOneTextureFromAllImages) {
  const Eigen::VectorXd c = take_pictures();
  const FitPersonSummary person = fit_person(person_options());
  EXPECT_LT((person.fit.shape_coefficients - c).cwiseAbs().maxCoeff(), 0.05);  // the prior is left
  for (const char* ending :
       {".obj", ".mtl", ".glb", ".json", "_isomap.png", "_texture.png", "_sources.png", "_frontal.png"})
    EXPECT_TRUE(fs::exists(folder_ / "out" / ("person" + std::string(ending)))) << ending;
  for (const char* ending : {".json", "_isomap.png", "_overlay.png"})
    EXPECT_TRUE(fs::exists(folder_ / "out" / ("frame_03" + std::string(ending)))) << ending;
  EXPECT_FALSE(fs::exists(folder_ / "out/frame_03.obj"));
  const auto json = nlohmann::json::parse(file("out/person.json"));
  EXPECT_EQ(json["used_images"], 3);
  EXPECT_EQ(nlohmann::json::parse(file("out/frame_01.json"))["shape_coefficients"], json["shape_coefficients"]);
  double shares = 0;
  for (const auto& image : json["images"]) shares += image["texture_share"].get<double>();
  EXPECT_NEAR(shares, 1, 1e-9);
}

TEST_F(FitPersonTest, AnUnusableImageLeavesThePersonAsWithoutIt) {
  take_pictures();
  fs::remove(folder_ / "frame_03.png");
  fit_person(person_options());
  const std::string before = file("out/person.obj"), texture = file("out/person_texture.png");
  write_file(folder_ / "frame_03.png", "no picture");
  const FitPersonSummary person = fit_person(person_options());
  EXPECT_EQ(person.images.failed, 1);
  EXPECT_EQ(file("out/person.obj"), before);
  EXPECT_EQ(file("out/person_texture.png"), texture);
  EXPECT_THAT(file("out/problematic/frame_03.txt"), HasSubstr("frame_03.png"));
  EXPECT_THAT(file("out/fits.csv"), HasSubstr("frame_03.png,frame_03.json,no,"));
}

TEST_F(FitPersonTest, NothingOfAnEarlierRunIsLeftWhereNoImageCanBeUsed) {
  take_pictures();
  fit_person(person_options());
  for (const char* name : {"frame_01.json", "frame_02.json", "frame_03.json"}) write_file(folder_ / name, "{}");
  EXPECT_THROW(fit_person(person_options()), InvalidInput);
  EXPECT_FALSE(fs::exists(folder_ / "out/person.obj"));
  EXPECT_FALSE(fs::exists(folder_ / "out/person.json"));
  EXPECT_TRUE(fs::exists(folder_ / "out/problematic/frame_02.txt"));
}

TEST_F(FitPersonTest, BytesDoNotDependOnThreads) {
  take_pictures();
  FitImagesOptions o = person_options();
  o.jobs = 1;
  fit_person(o);
  o.jobs = 3;
  o.output = folder_ / "out3";
  fit_person(o);
  for (const auto& entry : fs::directory_iterator(folder_ / "out")) {
    const std::string name = entry.path().filename().string();
    EXPECT_EQ(file("out/" + name), file("out3/" + name)) << name;
  }
}

TEST_F(FitPersonTest, AnImageMayNotHaveThePersonsName) {
  take_picture("person", 1);
  take_picture("frame_01", 2);
  FitImagesOptions o = options();
  o.images = {folder_ / "person.png"};
  EXPECT_THAT([&] { fit_person(o); }, ThrowsMessage<InvalidInput>(HasSubstr("rename")));
}

TEST_F(FitPersonTest, ModelsWithoutColourAndTextureCoordinatesGiveShapes) {
  take_pictures();
  make_plain();
  const FitPersonSummary person = fit_person(person_options());
  EXPECT_FALSE(person.images.textured);
  EXPECT_TRUE(fs::exists(folder_ / "out/person.obj"));
  EXPECT_TRUE(fs::exists(folder_ / "out/person_frontal.png"));
  EXPECT_FALSE(fs::exists(folder_ / "out/person_texture.png"));
  FitImagesOptions o = person_options();
  o.perspective = true;
  EXPECT_EQ(fit_images(o).fitted, 3);
  EXPECT_FALSE(fs::exists(folder_ / "out/person_isomap.png"));
}

}  // namespace
}  // namespace facewright
