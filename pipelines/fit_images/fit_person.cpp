// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/fit_images/fit_person.h"

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
constexpr const char* person = "person";

void check(const FitImagesOptions& options, const MorphableModel& model) {
  check_inputs(options, model);
  if (options.perspective)
    throw InvalidInput(
        "fit: several images of one person are fitted with orthographic or affine cameras; choose one of these, or fit "
        "the images one by one");
  for (const fs::path& image : options.images)
    if (image.stem() == person)
      throw InvalidInput(image.string() + ": its results and those of the person would have the same names, " +
                         std::string(person) + ".*; rename the image");
}

/// The work on one person; each step is one line of the recipe.
class PersonFit {
 public:
  PersonFit(const FitImagesOptions& options, const Progress& progress)
      : options_(options), progress_(progress), model_((try_model_file(options.model), load_model(options.model))) {
    check(options, model_);
    if (!options.mapping.empty()) mapper_ = read_landmark_mapping(options.mapping);
    fs::create_directories(options.output);
    remove_results(options, person);
    summary_.images.textured = model_.uv().rows() > 0;
    outcomes().resize(options.images.size());
    for (size_t i = 0; i < outcomes().size(); ++i) {
      outcomes()[i].image = options.images[i];
      remove_results(options, stem(i));
    }
  }

  FitPersonSummary run() try {
    read_landmarks();
    fit_shape();
    take_textures();
    write_person();
    for (const FittedImage& image : outcomes()) note_problem(options_, image);
    write_file(options_.output / "fits.csv", fits_csv(outcomes()));
    return std::move(summary_);
  } catch (...) {  // nothing half written
    remove_results(options_, person);
    throw;
  }

 private:
  std::vector<FittedImage>& outcomes() { return summary_.images.images; }
  std::string stem(size_t i) const { return options_.images[i].stem().string(); }

  void fail(size_t i, const std::exception& error) {
    FittedImage& image = outcomes()[i];
    image.fitted = false;
    image.reason = reason_of(image, error);
    image.fit = {};
    remove_results(options_, stem(i));
  }

  /// Runs `work` for every image that has not failed; what it throws is that image's failure.
  template <typename Work>
  void for_each_image(const char* stage, Work work) {
    std::atomic<int> done{0};
    const int total = static_cast<int>(outcomes().size());
    parallel_for(total, options_.jobs, [&](int k) {
      const auto i = static_cast<size_t>(k);
      if (outcomes()[i].reason.empty()) try {
          work(i);
        } catch (const std::exception& error) {
          fail(i, error);
        }
      const int n = ++done;
      if (progress_) progress_({stage, n, total, outcomes()[i].image.filename().string()});
    });
  }

  /// None left: the reasons are written all the same.
  void require_images() {
    try {
      count_images(summary_.images);
    } catch (const InvalidInput&) {
      for (const FittedImage& image : outcomes()) note_problem(options_, image);
      write_file(options_.output / "fits.csv", fits_csv(outcomes()));
      throw;
    }
  }

  void read_landmarks() {
    landmarks_.resize(outcomes().size());
    for_each_image("reading", [&](size_t i) {
      FittedImage& outcome = outcomes()[i];
      outcome.landmarks = landmark_file(options_, i);
      const Image image = read_image(options_.images[i]);  // the fit must not lean on an image that cannot be read
      landmarks_[i] = outcome.landmarks.empty() ? options_.finder(image) : read_image_landmarks(outcome.landmarks);
      outcome.fitted = true;
    });
    require_images();
  }

  void fit_shape() {
    std::vector<size_t> rows;
    std::vector<ImageLandmarks> seen;
    for (size_t i = 0; i < outcomes().size(); ++i)
      if (outcomes()[i].fitted) rows.push_back(i), seen.push_back(landmarks_[i]);
    try {
      summary_.fit = fit_landmarks_multi(model_, seen, options_.fit.fit, mapper_);
    } catch (const InvalidInput& error) {
      for (const size_t i : rows) fail(i, error);
      require_images();
    }
    for (size_t k = 0; k < rows.size(); ++k) {
      const auto failed = summary_.fit.summary.failed.find(k);
      if (failed != summary_.fit.summary.failed.end()) {
        fail(rows[k], InvalidInput(failed->second));
        continue;
      }
      outcomes()[rows[k]].fit = summary_.fit.images[k];
      outcomes()[rows[k]].fit.shape_covariance = summary_.fit.shape_covariance;
    }
    count_images(summary_.images);
  }

  void take_textures() {
    if (summary_.images.textured) texels_ = isomap_texels(model_.mean(options_.fit.level), options_.fit.texture.size);
    textures_.resize(outcomes().size());
    const int coarse = model_.vertex_count(0);
    for_each_image("texture", [&](size_t i) {
      const FittedImage& outcome = outcomes()[i];
      const Image image = read_image(options_.images[i]);
      FittedFace face;
      face.mesh = fitted_mesh(model_, outcome.fit, options_.fit.level);
      if (summary_.images.textured) {
        TextureOptions texture = options_.fit.texture;
        texture.threads = options_.images.size() > 1 ? 1 : options_.jobs;
        face.texture = extract_texture(face.mesh, texels_, image, outcome.fit.camera, texture);
        write_png(options_.output / (stem(i) + "_isomap.png"), face.texture.isomap);
      }
      write_png(options_.output / (stem(i) + "_overlay.png"),
                fit_overlay(image, face.mesh.V.topRows(coarse), model_.faces(0), outcome.fit));
      write_file(options_.output / (stem(i) + ".json"), fit_json(outcome, face));
      textures_[i] = std::move(face.texture);
    });
    require_images();
  }

  void write_person() {
    FittedFace face;
    FitResult neutral;
    neutral.shape_coefficients = summary_.fit.shape_coefficients;
    face.mesh = fitted_mesh(model_, neutral, options_.fit.level);
    if (summary_.images.textured) {
      std::vector<Image> isomaps;
      std::vector<double> resolutions;
      for (size_t i = 0; i < textures_.size(); ++i) {
        if (!outcomes()[i].fitted) continue;
        isomaps.push_back(std::move(textures_[i].isomap));
        resolutions.push_back(textures_[i].summary.resolution);
      }
      MergedTexture merged = merge_textures(isomaps, resolutions);
      summary_.merge = std::move(merged.summary);
      face.texture.isomap = std::move(merged.isomap);
      face.completed =
          complete_texture(model_, options_.fit.level, face.texture.isomap, texels_, options_.fit.completion);
    }
    face.frontal = frontal_view(face.mesh, face.completed.texture, options_.fit.frontal_size, options_.jobs);
    save_face(options_, person, face);
    write_file(options_.output / (std::string(person) + ".json"), person_json(summary_, face));
    if (options_.page) write_page(face);
  }

  void write_page(const FittedFace& face) {
    constexpr size_t kMostOverlays = 24;
    FitPage page{person, {{"From the front", face.frontal}, {"What the images showed", face.texture.isomap}}, {}, {}};
    for (size_t i = 0; i < outcomes().size(); ++i) {
      if (!outcomes()[i].fitted) continue;
      page.names.push_back(options_.images[i].filename().string());
      page.fits.push_back(fit_numbers(outcomes()[i]));
      if (page.names.size() <= kMostOverlays)
        page.pictures.emplace_back("The fit over " + page.names.back(),
                                   read_image(options_.output / (stem(i) + "_overlay.png")));
    }
    write_file(options_.output / (std::string(person) + ".html"), fit_page(face, page));
  }

  const FitImagesOptions& options_;
  const Progress& progress_;
  MorphableModel model_;
  LandmarkMapper mapper_;
  IsomapTexels texels_;
  std::vector<ImageLandmarks> landmarks_;
  std::vector<TextureResult> textures_;
  FitPersonSummary summary_;
};

}  // namespace

FitPersonSummary fit_person(const FitImagesOptions& options, const Progress& progress) {
  return PersonFit(options, progress).run();
}

}  // namespace facewright
