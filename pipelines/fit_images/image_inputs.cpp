// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/fit_images/image_inputs.h"

#include <optional>

#include "libmodel/core/errors.h"
#include "libmodel/interop/mesh_glb.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/mesh_files.h"

namespace facewright {

namespace fs = std::filesystem;

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

void save_face(const FitImagesOptions& options, const std::string& stem, const FittedFace& face) {
  const auto path = [&](const std::string& ending) { return options.output / (stem + ending); };
  std::optional<ObjMaterial> material;
  Mesh mesh = face.mesh;
  if (!face.texture.isomap.empty()) write_png(path("_isomap.png"), face.texture.isomap);
  if (!face.completed.texture.empty()) {
    material = ObjMaterial{stem + "_texture.png"};
    write_png(options.output / material->texture_file, face.completed.texture);
    write_png(path("_sources.png"), face.completed.sources);
    mesh.colours.resize(0, 3);  // the texture carries them
  }
  write_obj(path(".obj"), mesh, material);
  if (options.glb) write_file(path(".glb"), mesh_glb_bytes(mesh, face.completed.texture));
  write_png(path("_frontal.png"), face.frontal);
  if (!face.overlay.empty()) write_png(path("_overlay.png"), face.overlay);
}

void remove_results(const FitImagesOptions& options, const std::string& stem) {
  for (const char* ending : {"_isomap.png", "_texture.png", "_sources.png", "_frontal.png", "_overlay.png", ".obj",
                             ".mtl", ".glb", ".json", ".html"}) {
    std::error_code ignored;
    fs::remove(options.output / (stem + ending), ignored);
  }
}

void check_inputs(const FitImagesOptions& options, const MorphableModel& model) {
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
  if (options.perspective && options.fit.fit.jaw == JawMode::contour)
    throw InvalidInput(
        "fit: outlines are matched under orthographic cameras only; choose another jaw mode than contour, or another "
        "camera than perspective");
  if (!options.perspective && (options.focal_px > 0 || options.principal))
    throw InvalidInput("fit: a focal length or principal point belongs to the perspective camera; choose that one");
}

std::string reason_of(const FittedImage& image, const std::exception& error) {
  if (dynamic_cast<const IoError*>(&error)) return error.what();  // names its file
  const std::string with = image.landmarks.empty() ? "" : " with " + image.landmarks.string();
  return image.image.string() + with + ": " + error.what();
}

void note_problem(const FitImagesOptions& options, const FittedImage& image) {
  const fs::path problem = options.output / "problematic" / (image.image.stem().string() + ".txt");
  if (!image.fitted) return write_file(problem, image.reason + "\n");
  std::error_code ignored;
  fs::remove(problem, ignored);
}

void count_images(FitImagesSummary& summary) {
  summary.fitted = summary.failed = 0;
  for (const FittedImage& image : summary.images) ++(image.fitted ? summary.fitted : summary.failed);
  if (summary.fitted > 0) return;
  throw InvalidInput(summary.failed == 1 ? summary.images.front().reason
                                         : "none of the " + std::to_string(summary.failed) +
                                               " images could be fitted; the first: " + summary.images.front().reason);
}

}  // namespace facewright
