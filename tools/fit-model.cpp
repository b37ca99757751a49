// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Images with a face each to shape, pose, texture and frontal view.
#include <array>
#include <cstdio>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>

#include "libmodel/core/errors.h"
#include "pipelines/fit_images/fit_images.h"
#include "pipelines/fit_images/image_list.h"
#include "tools/cli.h"
#ifdef FACEWRIGHT_HAS_LANDMARKING
#include "libregister/landmarking/image_landmarks.h"
#endif

using namespace facewright;

namespace {

#ifdef FACEWRIGHT_HAS_LANDMARKING
// Detectors are made when the first image needs one, one per thread that asks at the same time.
class DetectorPool {
 public:
  explicit DetectorPool(std::string predictor) : predictor_(std::move(predictor)) {}

  ImageLandmarks find(const Image& image) {
    FaceDetector detector = take();
    std::vector<DetectedFace> faces = detector.detect(image);
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(detector));
    if (faces.empty())
      throw InvalidInput(
          "landmarks: there is no landmark file, and no face was found in the image; place landmarks by "
          "hand and name the file with --landmarks");
    return std::move(faces.front().landmarks);
  }

 private:
  FaceDetector take() {
    const std::lock_guard lock(mutex_);
    if (!first_) first_ = std::make_unique<FaceDetector>(predictor_);
    if (free_.empty()) return first_->copy();
    FaceDetector detector = std::move(free_.back());
    free_.pop_back();
    return detector;
  }

  std::string predictor_;
  std::mutex mutex_;
  std::unique_ptr<FaceDetector> first_;
  std::vector<FaceDetector> free_;
};

LandmarkFinder landmark_finder(const std::string& predictor) {
  if (!FaceDetector::available()) return {};
  auto pool = std::make_shared<DetectorPool>(predictor);
  return [pool](const Image& image) { return pool->find(image); };
}
#else
LandmarkFinder landmark_finder(const std::string&) { return {}; }
#endif

std::string describe(const FittedImage& image) {
  const FitSummary& s = image.fit.summary;
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                ": landmark rms %.2f px (%.2f %% of the outer eye distance), yaw %.1f deg, %s after %d rounds",
                s.rms_px, s.rms_percent, image.fit.pose.yaw * 180 / std::numbers::pi, to_string(s.stop).c_str(),
                s.iterations);
  return image.image.filename().string() + text.data() + (image.landmarks.empty() ? ", landmarks found in it" : "");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Fits a morphable model to images of faces: shape, pose, texture, frontal view.", "fit-model");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::output | CommonFlags::jobs,
                     "fit-model --model model.h5 --image portrait.png --landmarks portrait.pts -o fitted");
  FitImagesOptions options;
  FitOptions& fit = options.fit.fit;
  std::vector<std::string> images, landmarks;
  std::string model, mapping, predictor;
  app.add_option("--model", model, "Model file (.h5)")->required()->check(CLI::ExistingFile);
  app.add_option("--image", images, "Images of one face each, folders of them, or sequences such as frame_%04d.png")
      ->required();
  app.add_option("--landmarks", landmarks,
                 "Landmark files in the order of the images (default: .pts, .json or .ljson beside each image; without "
                 "one the face is searched for, if dlib is installed)");
  app.add_option("--predictor", predictor,
                 "dlib's 68-landmark predictor, for images without landmarks (default: where Debian's libdlib-data "
                 "puts it)");
  app.add_option("--mapping", mapping, "Landmark mapping, if the names differ from the model's");
  app.add_option("--level", options.fit.level, "Model level of the mesh, 0 = coarsest, -1 = finest");
  app.add_option("--modes", fit.modes, "Shape modes to use, -1 = all");
  app.add_option("--lambda", fit.lambda, "Weight of the shape prior, 1 = calibrated")->check(CLI::NonNegativeNumber);
  app.add_option("--sigma-px", fit.sigma_px, "Landmark standard deviation in pixels, 0 = from --sigma-mm")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--sigma-mm", fit.sigma_mm, "Landmark standard deviation on the face, mm")->check(CLI::PositiveNumber);
  app.add_option("--iterations", fit.iterations, "Rounds of pose and shape at most")->check(CLI::Range(1, 100000));
  const std::map<std::string, JawMode> jaws = {{"exclude", JawMode::exclude},
                                               {"slide", JawMode::slide},
                                               {"fixed", JawMode::fixed},
                                               {"contour", JawMode::contour}};
  const std::map<std::string, CameraKind> cameras = {{"orthographic", CameraKind::orthographic},
                                                     {"affine", CameraKind::affine}};
  std::string jaw = "slide", camera = "orthographic";
  app.add_option("--jaw", jaw,
                 "Jaw landmarks 1..17: exclude, slide (along the jaw line), fixed, or contour (of the posed face)")
      ->check(CLI::IsMember({"exclude", "slide", "fixed", "contour"}));
  app.add_option("--camera", camera, "orthographic (more accurate) or affine (the paper's)")
      ->check(CLI::IsMember({"orthographic", "affine"}));
  const std::map<std::string, ExpressionMode> expressions = {{"auto", ExpressionMode::automatic},
                                                             {"none", ExpressionMode::none},
                                                             {"blendshapes", ExpressionMode::blendshapes},
                                                             {"modes", ExpressionMode::modes}};
  std::string expression = "auto";
  app.add_option("--expression", expression, "auto (what the model has), none, blendshapes or modes")
      ->check(CLI::IsMember({"auto", "none", "blendshapes", "modes"}));
  app.add_option("--texture-size", options.fit.texture.size, "Texels along each side of the isomap")
      ->check(CLI::Range(8, 8192));
  app.add_flag("!--no-glb", options.glb, "Write no .glb beside the .obj");
  return run_program(argc, argv, app, common, [&] {
    fit.jaw = jaws.at(jaw);
    fit.camera = cameras.at(camera);
    fit.expression.mode = expressions.at(expression);
    options.model = model;
    options.mapping = mapping;
    options.output = common.output;
    options.jobs = common.jobs;
    options.images = list_images(images);
    options.landmarks.assign(landmarks.begin(), landmarks.end());
    options.finder = landmark_finder(predictor);
    ProgressBar bar(common);
    const FitImagesSummary summary = fit_images(options, options.images.size() > 1 ? bar.progress() : Progress{});
    for (const FittedImage& image : summary.images)
      if (image.fitted)
        report(common, describe(image));
      else
        std::cerr << "fit-model: " << image.reason << "\n";
    if (!summary.textured)
      report(common, model + " has no texture coordinates: no isomap, the frontal view shows the mean colours");
    return summary.failed > 0 ? ExitCode::some_failed : ExitCode::ok;
  });
}
