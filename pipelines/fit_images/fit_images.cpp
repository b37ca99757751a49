// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/fit_images/fit_images.h"

#include <atomic>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/model/model_file.h"
#include "pipelines/fit_images/fit_page.h"
#include "pipelines/fit_images/fit_record.h"
#include "pipelines/fit_images/image_inputs.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

PerspectiveModelOptions perspective_options(const FitImagesOptions& options) {
  PerspectiveModelOptions o;
  o.fit.fit = options.fit.fit;
  o.fit.camera.focal_px = options.focal_px;
  o.centred = !options.principal;
  if (options.principal) o.fit.camera.principal = *options.principal;
  o.texture = options.fit.texture;
  o.completion = options.fit.completion;
  o.level = options.fit.level;
  o.frontal_size = options.fit.frontal_size;
  return o;
}

void save(const FitImagesOptions& options, const FittedImage& image, const Image& picture, const FittedFace& face) {
  const std::string stem = image.image.stem().string();
  save_face(options, stem, face);
  if (options.page) {
    const FitPage page{stem,
                       {{"The image", picture},
                        {"The fit over it: landmarks green, where the fit has them red", face.overlay},
                        {"From the front", face.frontal},
                        {"What the image showed of the texture", face.texture.isomap}},
                       {fit_numbers(image)},
                       {image.image.filename().string()}};
    write_file(options.output / (stem + ".html"), fit_page(face, page));
  }
  write_file(options.output / (stem + ".json"), fit_json(image, face));
}

void fit_one(const FitImagesOptions& options, const MorphableModel& model, const LandmarkMapper& mapper, size_t i,
             FittedImage* outcome) {
  outcome->landmarks = landmark_file(options, i);
  const Image image = read_image(options.images[i]);
  const ImageLandmarks landmarks =
      outcome->landmarks.empty() ? options.finder(image) : read_image_landmarks(outcome->landmarks);
  const int threads = options.images.size() > 1 ? 1 : options.jobs;  // one image has all, many have one each
  if (options.perspective) {
    PerspectiveModelOptions fit = perspective_options(options);
    fit.threads = threads;
    const PerspectiveModelResult result = fit_model(model, image, landmarks, fit, mapper);
    outcome->perspective = result.fit;
    save(options, *outcome, image, result);
  } else {
    FitModelOptions fit = options.fit;
    fit.threads = threads;
    const FitModelResult result = fit_model(model, image, landmarks, fit, mapper);
    outcome->fit = result.fit;
    save(options, *outcome, image, result);
  }
  outcome->fitted = true;
}

}  // namespace

FitImagesSummary fit_images(const FitImagesOptions& options, const Progress& progress) {
  try_model_file(options.model);
  const MorphableModel model = load_model(options.model);
  check_inputs(options, model);
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
    const std::string stem = outcome.image.stem().string();
    remove_results(options, stem);
    try {
      fit_one(options, model, mapper, i, &outcome);
    } catch (const std::exception& error) {
      outcome.reason = reason_of(outcome, error);
      remove_results(options, stem);  // nothing half written
    }
    note_problem(options, outcome);
    const int n = ++done;
    if (progress) progress({"fitting", n, total, outcome.image.filename().string()});
  });
  write_file(options.output / "fits.csv", fits_csv(summary.images));
  count_images(summary);
  return summary;
}

}  // namespace facewright
