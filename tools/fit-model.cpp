// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>
#include <array>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "libmodel/core/errors.h"
#include "libmodel/fitting/fit_model.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"
#include "tools/cli.h"
using namespace facewright;

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Settings {
  std::string model;
  std::vector<std::string> images, landmarks;
  std::string mapping;
  FitModelOptions fit;
};

/// The landmark file given for the image, or the one beside it.
fs::path landmark_path(const Settings& settings, size_t i) {
  if (i < settings.landmarks.size()) return settings.landmarks[i];
  for (const char* extension : {".pts", ".json", ".ljson"}) {
    const fs::path beside = fs::path(settings.images[i]).replace_extension(extension);
    if (fs::is_regular_file(beside)) return beside;
  }
  throw InvalidInput(settings.images[i] + ": landmarks: expected " + fs::path(settings.images[i]).stem().string() +
                     ".pts or .json beside the image, found none; name the file with --landmarks");
}

Json numbers(const Eigen::VectorXd& x) { return std::vector<double>(x.data(), x.data() + x.size()); }

Json to_json(const FitModelResult& result, const fs::path& image, const fs::path& landmarks) {
  constexpr double degrees = 180 / std::numbers::pi;
  const FitResult& fit = result.fit;
  const FitSummary& s = fit.summary;
  Json json;
  json["image"] = image.filename().string();
  json["landmarks"] = landmarks.filename().string();
  json["stop"] = to_string(s.stop);
  json["iterations"] = s.iterations;
  json["last_change"] = s.last_change;
  json["pose"] = {{"order", "R = Ry(yaw) Rx(pitch) Rz(roll), head to camera axes (+x right, +y up, +z to the viewer)"},
                  {"yaw_deg", fit.pose.yaw * degrees},
                  {"pitch_deg", fit.pose.pitch * degrees},
                  {"roll_deg", fit.pose.roll * degrees}};
  json["camera"] = {{"convention", "pixel = A x + b, x in mm, centre of the top-left pixel is (0, 0), y down"},
                    {"A", {numbers(fit.camera.A.row(0)), numbers(fit.camera.A.row(1))}},
                    {"b", numbers(fit.camera.b)},
                    {"pixels_per_mm", fit.orthographic.s}};
  json["shape_coefficients"] = numbers(fit.shape_coefficients);
  json["expression_coefficients"] = numbers(fit.expression_coefficients);
  json["landmark_rms_px"] = s.rms_px;
  json["landmark_rms_percent_of_outer_eye_distance"] = s.rms_percent;
  json["outer_eye_distance_px"] = s.outer_eye_distance_px;
  json["sigma_px"] = s.sigma_px;
  json["lambda"] = s.options.lambda;
  json["unknown_landmarks"] = s.unknown;
  for (const LandmarkResidual& r : s.residuals)
    json["residuals"][r.name] = {{"vertex", r.vertex},
                                 {"measured", numbers(r.measured)},
                                 {"fitted", numbers(r.fitted)},
                                 {"error_px", (r.measured - r.fitted).norm()},
                                 {"used", r.used}};
  json["texture"] = {{"visible_share", static_cast<double>(result.texture.summary.visible_texels) /
                                           std::max(result.texture.summary.mapped_texels, 1)},
                     {"mean_alpha", result.texture.summary.mean_alpha}};
  return json;
}

void save(const fs::path& folder, const std::string& stem, const FitModelResult& result, const Json& json) {
  std::optional<ObjMaterial> material;
  if (!result.texture.isomap.empty()) {
    material = ObjMaterial{stem + "_isomap.png"};
    write_png(folder / material->texture_file, result.texture.isomap);
  }
  Mesh mesh = result.mesh;
  if (material) mesh.colours.resize(0, 3);  // the texture carries them
  write_obj(folder / (stem + ".obj"), mesh, material);
  write_png(folder / (stem + "_frontal.png"), result.frontal);
  write_png(folder / (stem + "_overlay.png"), result.overlay);
  write_file(folder / (stem + ".json"), json.dump(1) + "\n");
}

std::string describe(const fs::path& image, const FitModelResult& result) {
  const FitSummary& s = result.fit.summary;
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                ": landmark rms %.2f px (%.2f %% of the outer eye distance), yaw %.1f deg, %s after %d rounds",
                s.rms_px, s.rms_percent, result.fit.pose.yaw * 180 / std::numbers::pi, to_string(s.stop).c_str(),
                s.iterations);
  return image.filename().string() + text.data();
}

/// Fits one image; the message of a failure names the image and the landmark file.
void fit_one(const Settings& settings, const CommonOptions& common, const MorphableModel& model,
             const LandmarkMapper& mapper, size_t i) {
  const fs::path image = settings.images[i], landmarks = landmark_path(settings, i);
  try {
    const FitModelResult result =
        fit_model(model, read_image(image), read_image_landmarks(landmarks), settings.fit, mapper);
    save(common.output, image.stem().string(), result, to_json(result, image, landmarks));
    report(common, describe(image, result));
    if (result.texture.isomap.empty())
      report(common,
             settings.model + " has no texture coordinates: no isomap, the frontal view shows the mean colours");
  } catch (const InvalidInput& e) {
    throw InvalidInput(image.string() + " with " + landmarks.string() + ": " + e.what());
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Fits a morphable model to images with landmarks: shape, pose, texture, frontal view.", "fit-model");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::output | CommonFlags::jobs,
                     "fit-model --model model.h5 --image portrait.png --landmarks portrait.pts -o fitted");
  Settings settings;
  FitOptions& fit = settings.fit.fit;
  app.add_option("--model", settings.model, "Model file (.h5)")->required()->check(CLI::ExistingFile);
  app.add_option("--image", settings.images, "Images, one face each")->required()->check(CLI::ExistingFile);
  app.add_option("--landmarks", settings.landmarks,
                 "Landmark files in the order of the images (default: .pts or .json beside each image)");
  app.add_option("--mapping", settings.mapping, "eos landmark mapping, if the names differ from the model's");
  app.add_option("--level", settings.fit.level, "Model level of the mesh, 0 = coarsest, -1 = finest");
  app.add_option("--modes", fit.modes, "Shape modes to use, -1 = all");
  app.add_option("--lambda", fit.lambda, "Weight of the shape prior, 1 = calibrated")->check(CLI::NonNegativeNumber);
  app.add_option("--sigma-px", fit.sigma_px, "Landmark standard deviation in pixels, 0 = from --sigma-mm")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--sigma-mm", fit.sigma_mm, "Landmark standard deviation on the face, mm")->check(CLI::PositiveNumber);
  app.add_option("--iterations", fit.iterations, "Rounds of pose and shape at most")->check(CLI::Range(1, 100000));
  const std::map<std::string, JawMode> jaws = {
      {"exclude", JawMode::exclude}, {"slide", JawMode::slide}, {"fixed", JawMode::fixed}};
  const std::map<std::string, CameraKind> cameras = {{"orthographic", CameraKind::orthographic},
                                                     {"affine", CameraKind::affine}};
  std::string jaw = "slide", camera = "orthographic";
  app.add_option("--jaw", jaw, "Jaw landmarks 1..17: exclude, slide (along the jaw line) or fixed")
      ->check(CLI::IsMember({"exclude", "slide", "fixed"}));
  app.add_option("--camera", camera, "orthographic (more accurate) or affine (the paper's)")
      ->check(CLI::IsMember({"orthographic", "affine"}));
  app.add_option("--texture-size", settings.fit.texture.size, "Texels along each side of the isomap")
      ->check(CLI::Range(8, 8192));
  return run_program(argc, argv, app, common, [&] {
    fit.jaw = jaws.at(jaw);
    fit.camera = cameras.at(camera);
    settings.fit.threads = common.jobs;
    if (!settings.landmarks.empty() && settings.landmarks.size() != settings.images.size())
      throw InvalidInput("--landmarks: expected one file per image (" + std::to_string(settings.images.size()) +
                         "), got " + std::to_string(settings.landmarks.size()));
    const MorphableModel model = load_model(settings.model);
    if (settings.fit.level >= model.level_count())
      throw InvalidInput(settings.model + ": --level: expected -1.." + std::to_string(model.level_count() - 1) +
                         ", got " + std::to_string(settings.fit.level));
    const LandmarkMapper mapper = settings.mapping.empty() ? LandmarkMapper() : read_landmark_mapping(settings.mapping);
    fs::create_directories(common.output);
    int failed = 0;
    for (size_t i = 0; i < settings.images.size(); ++i) {
      try {
        fit_one(settings, common, model, mapper, i);
      } catch (const std::exception& e) {
        if (settings.images.size() == 1) throw;
        const std::string stem = fs::path(settings.images[i]).stem().string();
        write_file(common.output / "problematic" / (stem + ".txt"), std::string(e.what()) + "\n");
        std::cerr << "fit-model: " << e.what() << "\n";
        ++failed;
      }
    }
    if (failed == static_cast<int>(settings.images.size())) throw InvalidInput("none of the images could be fitted");
    return failed > 0 ? ExitCode::some_failed : ExitCode::ok;
  });
}
