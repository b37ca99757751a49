// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/fit_images/fit_images.h"

#include <atomic>
#include <optional>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/interop/mesh_glb.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"
#include "pipelines/fit_images/fit_record.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

// The landmark file given for the image or lying beside it, or nothing if the image itself is to be searched.
fs::path landmark_file(const FitImagesOptions& options, size_t i) {
  if (i < options.landmarks.size()) return options.landmarks[i];
  for (const char* extension : {".pts", ".json", ".ljson"}) {
    const fs::path beside = fs::path(options.images[i]).replace_extension(extension);
    if (fs::is_regular_file(beside)) return beside;
  }
  if (options.finder) return {};
  throw InvalidInput("landmarks: expected " + options.images[i].stem().string() +
                     ".pts, .json or .ljson beside the image, found none; name the file with --landmarks");
}

void save(const FitImagesOptions& options, const FittedImage& image, const FitModelResult& result) {
  const std::string stem = image.image.stem().string();
  const auto path = [&](const std::string& ending) { return options.output / (stem + ending); };
  std::optional<ObjMaterial> material;
  Mesh mesh = result.mesh;
  if (!result.texture.isomap.empty()) write_png(path("_isomap.png"), result.texture.isomap);
  if (!result.completed.texture.empty()) {
    material = ObjMaterial{stem + "_texture.png"};
    write_png(options.output / material->texture_file, result.completed.texture);
    write_png(path("_sources.png"), result.completed.sources);
    mesh.colours.resize(0, 3);  // the texture carries them
  }
  write_obj(path(".obj"), mesh, material);
  if (options.glb) write_file(path(".glb"), mesh_glb_bytes(mesh, result.completed.texture));
  write_png(path("_frontal.png"), result.frontal);
  write_png(path("_overlay.png"), result.overlay);
  write_file(path(".json"), fit_json(image, result));
}

// What an earlier run made of an image of this name.
void remove_stale(const FitImagesOptions& options, const std::string& stem) {
  for (const char* ending : {"_isomap.png", "_texture.png", "_sources.png", "_frontal.png", "_overlay.png", ".obj",
                             ".mtl", ".glb", ".json"}) {
    std::error_code ignored;
    fs::remove(options.output / (stem + ending), ignored);
  }
}

void fit_one(const FitImagesOptions& options, const MorphableModel& model, const LandmarkMapper& mapper, size_t i,
             FittedImage* outcome) {
  remove_stale(options, options.images[i].stem().string());
  outcome->landmarks = landmark_file(options, i);
  const Image image = read_image(options.images[i]);
  const ImageLandmarks landmarks =
      outcome->landmarks.empty() ? options.finder(image) : read_image_landmarks(outcome->landmarks);
  FitModelOptions fit = options.fit;
  fit.threads = options.images.size() > 1 ? 1 : options.jobs;  // one image has all threads, many have one each
  const FitModelResult result = fit_model(model, image, landmarks, fit, mapper);
  outcome->fit = result.fit;
  save(options, *outcome, result);
  outcome->fitted = true;
}

void check(const FitImagesOptions& options, const MorphableModel& model) {
  if (options.images.empty()) throw InvalidInput("fit: there are no images");
  if (!options.landmarks.empty() && options.landmarks.size() != options.images.size())
    throw InvalidInput("landmarks: expected one file per image (" + std::to_string(options.images.size()) + "), got " +
                       std::to_string(options.landmarks.size()));
  for (const auto* sources : {&options.images, &options.landmarks})
    for (const fs::path& source : *sources) {
      std::error_code missing;
      if (fs::equivalent(source.has_parent_path() ? source.parent_path() : ".", options.output, missing))
        throw InvalidInput("output: " + options.output.string() + " is where " + source.filename().string() +
                           " lies, and results would overwrite landmarks; name another folder with -o");
    }
  if (options.fit.level >= model.level_count())
    throw InvalidInput(options.model.string() + ": level: expected -1.." + std::to_string(model.level_count() - 1) +
                       ", got " + std::to_string(options.fit.level));
}

// What went wrong with image i, in words that name the files.
std::string reason_of(const FittedImage& image, const std::exception& error) {
  if (dynamic_cast<const IoError*>(&error)) return error.what();  // names its file
  const std::string with = image.landmarks.empty() ? "" : " with " + image.landmarks.string();
  return image.image.string() + with + ": " + error.what();
}

}  // namespace

FitImagesSummary fit_images(const FitImagesOptions& options, const Progress& progress) {
  const MorphableModel model = load_model(options.model);
  check(options, model);
  const LandmarkMapper mapper = options.mapping.empty() ? LandmarkMapper() : read_landmark_mapping(options.mapping);
  fs::create_directories(options.output);
  FitImagesSummary summary;
  summary.textured = model.uv().rows() > 0;
  const int total = static_cast<int>(options.images.size());
  summary.images.resize(options.images.size());
  std::atomic<int> done{0};
  parallel_for(total, options.jobs, [&](int k) {
    const auto i = static_cast<size_t>(k);
    FittedImage& outcome = summary.images[i];
    outcome.image = options.images[i];
    const fs::path problem = options.output / "problematic" / (outcome.image.stem().string() + ".txt");
    try {
      fit_one(options, model, mapper, i, &outcome);
      fs::remove(problem);
    } catch (const std::exception& error) {
      outcome.reason = reason_of(outcome, error);
      write_file(problem, outcome.reason + "\n");
    }
    const int n = ++done;
    if (progress) progress({"fitting", n, total, outcome.image.filename().string()});
  });
  for (const FittedImage& image : summary.images) ++(image.fitted ? summary.fitted : summary.failed);
  write_file(options.output / "fits.csv", fits_csv(summary.images));
  if (summary.fitted == 0)
    throw InvalidInput(total == 1 ? summary.images.front().reason
                                  : "none of the " + std::to_string(total) +
                                        " images could be fitted; the first: " + summary.images.front().reason);
  return summary;
}

}  // namespace facewright
