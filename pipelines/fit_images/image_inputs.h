// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>

#include "pipelines/fit_images/fit_images.h"

namespace facewright {

/// Throws InvalidInput for options that do not go together, before anything is read or written.
void check_inputs(const FitImagesOptions& options, const MorphableModel& model);

/// The landmark file given for image i or lying beside it, or nothing if the image itself is to be searched. Throws
/// InvalidInput where there is neither.
std::filesystem::path landmark_file(const FitImagesOptions& options, size_t i);

/// What an earlier run made of an image of this stem goes.
void remove_results(const FitImagesOptions& options, const std::string& stem);

/// STEM.obj, .mtl, .glb and the pictures of a face; the isomap is that of the face's texture, the overlay may be empty.
void save_face(const FitImagesOptions& options, const std::string& stem, const FittedFace& face);

/// What went wrong with an image, in words that name its files.
std::string reason_of(const FittedImage& image, const std::exception& error);

/// problematic/STEM.txt: written with the image's reason, or taken away if it was fitted.
void note_problem(const FitImagesOptions& options, const FittedImage& image);

/// Counts of the images fitted and failed; throws InvalidInput with the first reason if none was.
void count_images(FitImagesSummary& summary);

}  // namespace facewright
