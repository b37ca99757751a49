// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/fit_images/fit_images.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace facewright
