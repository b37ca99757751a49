// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Images, scans or 3D landmarks of faces to shape, pose and texture.
#include <array>
#include <cstdio>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>

#include "libmodel/core/errors.h"
#include "pipelines/fit_images/fit_images.h"
#include "pipelines/fit_images/fit_person.h"
#include "pipelines/fit_images/fit_scan_files.h"
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

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 300> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

std::string describe(const FittedImage& image) {
  const FitNumbers n = fit_numbers(image);
  std::string line =
      image.image.filename().string() +
      format(": landmark rms %.2f px (%.2f %% of the outer eye distance), yaw %.1f deg, %s after %d rounds", n.rms_px,
             n.rms_percent, n.pose.yaw * 180 / std::numbers::pi, to_string(n.stop).c_str(), n.iterations);
  if (const auto& lens = image.perspective) {
    const bool given = lens->summary.options.camera.focal_px > 0;
    line += format(", focal length %.0f px (%s), %.0f mm away", lens->camera.focal_px,
                   given                            ? "given"
                   : lens->summary.focal_determined ? "estimated"
                                                    : "estimated, hardly more than its prior; --focal-px states it",
                   lens->summary.distance_mm);
  }
  return line + (image.landmarks.empty() ? ", landmarks found in it" : "");
}

// Everything the command line says.
struct Arguments {
  CommonOptions common;
  std::vector<std::string> images, landmarks;
  std::string scan, points, model, mapping, predictor;
  std::string jaw = "slide", camera = "orthographic", expression = "auto";
  std::vector<double> principal;
  bool one_person = false, refine = false;
  FitImagesOptions fit;
  FitScanFilesOptions scan_fit;
};

const std::map<std::string, JawMode> jaws = {
    {"exclude", JawMode::exclude}, {"slide", JawMode::slide}, {"fixed", JawMode::fixed}, {"contour", JawMode::contour}};
const std::map<std::string, ExpressionMode> expressions = {{"auto", ExpressionMode::automatic},
                                                           {"none", ExpressionMode::none},
                                                           {"blendshapes", ExpressionMode::blendshapes},
                                                           {"modes", ExpressionMode::modes}};

void add_inputs(CLI::App& app, Arguments& a) {
  app.add_option("--model", a.model, "Model file (.h5)")->required()->check(CLI::ExistingFile);
  app.add_option("--image", a.images, "Images of one face each, folders of them, or sequences such as frame_%04d.png")
      ->group("Input, one of");
  app.add_option("--scan", a.scan, "A scan of a face, mesh or points (.ply, .obj)")
      ->check(CLI::ExistingFile)
      ->group("Input, one of");
  app.add_option("--points", a.points, "3D landmarks alone (.json, .pts, .pp, .mrk.json, .fcsv, .ljson)")
      ->check(CLI::ExistingFile)
      ->group("Input, one of");
  app.add_option("--landmarks", a.landmarks,
                 "Landmark files in the order of the images (default: .pts, .json or .ljson beside each image; without "
                 "one the face is searched for, if dlib is installed); or the scan's, 3D (default: beside it)");
  app.add_option("--mapping", a.mapping, "Landmark mapping, if the names differ from the model's")
      ->check(CLI::ExistingFile);
}

void add_fit(CLI::App& app, Arguments& a) {
  FitOptions& fit = a.fit.fit.fit;
  app.add_option("--level", a.fit.fit.level, "Model level of the mesh, 0 = coarsest, -1 = finest")
      ->check(CLI::Range(-1, 100));
  app.add_option("--modes", fit.modes, "Shape modes to use, -1 = all")->check(CLI::Range(-1, 1000000));
  app.add_option("--lambda", fit.lambda, "Weight of the shape prior, 1 = calibrated")->check(CLI::NonNegativeNumber);
  app.add_option("--sigma-mm", fit.sigma_mm,
                 "Landmark standard deviation on the face, mm (scans and points: 1 unless stated)")
      ->check(CLI::PositiveNumber);
  app.add_option("--iterations", fit.iterations, "Rounds of pose and shape at most (scans: 30 per level)")
      ->check(CLI::Range(1, 100000));
  app.add_option("--expression", a.expression, "auto (what the model has), none, blendshapes (images only) or modes")
      ->check(CLI::IsMember({"auto", "none", "blendshapes", "modes"}));
}

void add_image_fit(CLI::App& app, Arguments& a) {
  const std::string group = "Images";
  app.add_flag("--one-person", a.one_person,
               "All images show one person: one shape and one texture from all of them, a pose and expression for each")
      ->group(group);
  app.add_option("--camera", a.camera,
                 "orthographic (more accurate), affine (the paper's) or perspective (faces near the camera)")
      ->check(CLI::IsMember({"orthographic", "affine", "perspective"}))
      ->group(group);
  app.add_option("--focal-px", a.fit.focal_px,
                 "Focal length of the perspective camera in pixels of the image (0: estimated)")
      ->check(CLI::NonNegativeNumber)
      ->group(group);
  app.add_option("--principal-px", a.principal,
                 "X Y: where its optical axis meets the image, pixels (default: the centre; state it for crops)")
      ->expected(2)
      ->group(group);
  app.add_option("--jaw", a.jaw,
                 "Jaw landmarks 1..17: exclude, slide (along the jaw line), fixed, or contour (of the posed face)")
      ->check(CLI::IsMember({"exclude", "slide", "fixed", "contour"}))
      ->group(group);
  app.add_option("--sigma-px", a.fit.fit.fit.sigma_px, "Landmark standard deviation in pixels, 0 = from --sigma-mm")
      ->check(CLI::NonNegativeNumber)
      ->group(group);
  app.add_option("--predictor", a.predictor,
                 "dlib's 68-landmark predictor, for images without landmarks (default: where Debian's libdlib-data "
                 "puts it)")
      ->group(group);
  app.add_option("--texture-size", a.fit.fit.texture.size, "Texels along each side of the isomap")
      ->check(CLI::Range(8, 8192))
      ->group(group);
  app.add_flag("!--no-glb", a.fit.glb, "Write no .glb beside the .obj")->group(group);
  app.add_flag("!--no-page", a.fit.page, "Write no page (.html) to look at the fit")->group(group);
}

void add_scan_fit(CLI::App& app, Arguments& a) {
  const std::string group = "Scans";
  app.add_option("--scan-sigma-mm", a.scan_fit.fit.sigma_mm, "Standard deviation of scan and model at one place, mm")
      ->check(CLI::PositiveNumber)
      ->group(group);
  app.add_flag("--refine", a.refine, "Also bend the fitted face onto the scan, beyond what the model can say")
      ->group(group);
  app.add_option("--refine-smoothing", a.scan_fit.refinement.smoothing_mm,
                 "Width of what the bending does not follow, mm")
      ->check(CLI::PositiveNumber)
      ->group(group);
  app.add_option("--error-range", a.scan_fit.error_range_mm, "Distance at which the error picture's colours end, mm")
      ->check(CLI::Range(0.001, 100.0))
      ->group(group);
}

// On the command line or in a file, and not as it would be anyhow: saved options name them all.
bool stated(const CLI::App& app, const std::string& name) {
  const CLI::Option* option = app.get_option(name);
  return option->count() > 0 && CLI::detail::join(option->results(), ",") != option->get_default_str();
}

// Options that do not go together, before anything is read.
void check_combination(const CLI::App& app, const Arguments& a) {
  const auto given = [&](const char* name) { return stated(app, name); };
  const auto refuse = [](const std::string& what) { throw CLI::ValidationError(what); };
  const int inputs = given("--image") + given("--scan") + given("--points");
  if (inputs != 1)
    refuse("expected one of --image, --scan and --points, got " + std::string(inputs == 0 ? "none" : "several"));
  const auto only_for = [&](std::initializer_list<const char*> names, bool allowed, const std::string& with) {
    for (const char* name : names)
      if (given(name) && !allowed) refuse(std::string(name) + " goes with " + with + " only; leave it out");
  };
  only_for({"--one-person", "--camera", "--focal-px", "--principal-px", "--jaw", "--sigma-px", "--predictor",
            "--texture-size", "--no-glb", "--no-page"},
           given("--image"), "--image");
  only_for({"--scan-sigma-mm", "--refine", "--refine-smoothing", "--error-range"}, given("--scan"), "--scan");
  only_for({"--refine-smoothing"}, a.refine, "--refine");
  only_for({"--units"}, !given("--image"), "--scan and --points");
  only_for({"--landmarks"}, !given("--points"), "--image and --scan");
  only_for({"--focal-px", "--principal-px"}, a.camera == "perspective", "--camera perspective");
  if (a.camera == "perspective" && a.jaw == "contour")
    refuse(
        "--jaw contour needs an orthographic or affine camera: outlines are not matched in perspective; choose "
        "--jaw slide, exclude or fixed");
  if (a.camera == "perspective" && a.one_person)
    refuse(
        "--one-person needs an orthographic or affine camera; leave --camera perspective out, or fit the images one "
        "by one");
  if (!given("--image") && a.expression == "blendshapes")
    refuse("--expression blendshapes goes with --image only: scans and points are fitted by expression modes");
  if (given("--scan") && a.landmarks.size() > 1)
    refuse("--landmarks: expected one file for the scan, got " + std::to_string(a.landmarks.size()));
}

void report_images(const Arguments& a, const FitImagesSummary& summary) {
  for (const FittedImage& image : summary.images)
    if (image.fitted)
      report(a.common, describe(image));
    else
      std::cerr << "fit-model: " << image.reason << "\n";
  if (!summary.textured)
    report(a.common, a.model + " has no texture coordinates: no isomap, the frontal view shows the mean colours");
}

int run_images(Arguments& a) {
  FitImagesOptions& options = a.fit;
  FitOptions& fit = options.fit.fit;
  fit.jaw = jaws.at(a.jaw);
  fit.camera = a.camera == "affine" ? CameraKind::affine : CameraKind::orthographic;
  fit.expression.mode = expressions.at(a.expression);
  options.perspective = a.camera == "perspective";
  if (!a.principal.empty()) options.principal = Eigen::Vector2d(a.principal[0], a.principal[1]);
  options.model = a.model;
  options.mapping = a.mapping;
  options.output = a.common.output;
  options.jobs = a.common.jobs;
  options.images = list_images(a.images);
  options.landmarks.assign(a.landmarks.begin(), a.landmarks.end());
  options.finder = landmark_finder(a.predictor);
  ProgressBar bar(a.common);
  const Progress progress = options.images.size() > 1 ? bar.progress() : Progress{};
  if (!a.one_person) {
    const FitImagesSummary summary = fit_images(options, progress);
    report_images(a, summary);
    return summary.failed > 0 ? ExitCode::some_failed : ExitCode::ok;
  }
  const FitPersonSummary person = fit_person(options, progress);
  report_images(a, person.images);
  report(a.common, format("person: one shape from %d images, %s after %d rounds: ", person.images.fitted,
                          to_string(person.fit.summary.stop).c_str(), person.fit.summary.iterations) +
                       (options.output / "person.obj").string());
  return person.images.failed > 0 ? ExitCode::some_failed : ExitCode::ok;
}

double mm_per_unit(const std::string& units) {
  const std::map<std::string, double> known = {{"auto", 0}, {"mm", 1}, {"cm", 10}, {"m", 1000}};
  return known.at(units);
}

int run_scan(const CLI::App& app, Arguments& a) {
  FitScanFilesOptions& options = a.scan_fit;
  const FitOptions& fit = a.fit.fit.fit;
  options.model = a.model;
  options.mapping = a.mapping;
  options.scan = a.scan;
  options.landmarks = !a.points.empty() ? a.points : a.landmarks.empty() ? "" : a.landmarks.front();
  options.output = a.common.output;
  options.mm_per_unit = mm_per_unit(a.common.units);
  options.refine = a.refine;
  options.fit.lambda = options.points.lambda = fit.lambda;
  options.fit.modes = options.points.modes = fit.modes;
  options.fit.level = a.fit.fit.level;
  options.fit.expression = options.points.expression = a.expression != "none";
  options.needs_expression = a.expression == "modes";
  options.fit.threads = options.refinement.threads = a.common.jobs;
  if (stated(app, "--sigma-mm")) options.fit.landmark_sigma_mm = options.points.sigma_mm = fit.sigma_mm;
  if (stated(app, "--iterations")) options.fit.iterations = options.points.iterations = fit.iterations;
  const FitScanFilesSummary summary = fit_scan_files(options);
  const std::string name = a.scan.empty() ? a.points : a.scan;
  if (summary.mm_per_unit != 1)
    report(a.common, name + format(": one unit is %g mm: ", summary.mm_per_unit) + summary.units_reason);
  if (const auto& scan = summary.scan)
    report(a.common, name + format(": %.2f mm from the scan (median of %d of %d vertices), landmark rms %.2f mm, %s",
                                   scan->summary.median_mm, scan->summary.matched, scan->summary.vertices,
                                   summary.landmark_rms_mm, to_string(scan->summary.stop).c_str()));
  if (const auto& points = summary.points)
    report(a.common, name + format(": landmark rms %.2f mm, %s after %d rounds", summary.landmark_rms_mm,
                                   to_string(points->summary.stop).c_str(), points->summary.iterations));
  if (const auto& refined = summary.refined)
    report(a.common, name + format(": refined, %.2f mm from the scan, moved by %.2f mm on average, %s after %d rounds",
                                   refined->summary.median_mm, refined->summary.mean_offset,
                                   to_string(refined->summary.stop).c_str(), refined->summary.iterations));
  report(a.common, "fit-model: wrote " + (options.output / (summary.stem + ".ply")).string());
  return ExitCode::ok;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Fits a morphable model to images of faces (shape, pose, texture, frontal view), to a scan, or to 3D landmarks.",
      "fit-model");
  Arguments a;
  add_common_options(app, a.common, CommonFlags::output | CommonFlags::jobs | CommonFlags::units,
                     "fit-model --model model.h5 --image portrait.png --landmarks portrait.pts -o fitted");
  add_inputs(app, a);
  add_fit(app, a);
  add_image_fit(app, a);
  add_scan_fit(app, a);
  return run_program(argc, argv, app, a.common, [&] {
    check_combination(app, a);
    return a.images.empty() ? run_scan(app, a) : run_images(a);
  });
}
