// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/fitting/merge_textures.h"
#include "pipelines/fit_images/fit_images.h"

namespace facewright {

struct FitPersonSummary {
  FitImagesSummary images;  ///< pose and expression of each
  MultiFitResult fit;       ///< the shape they share
  MergeSummary merge;       ///< of the images fitted, in order; empty without texture coordinates
};

/// As fit_images, for images or video frames of one person: one shape from all of them (fit_landmarks_multi), each with
/// its own pose and expression. Writes person.obj (neutral), .mtl, .glb, _isomap.png (merge_textures), _texture.png,
/// _sources.png, _frontal.png, person.json and person.html; for each image STEM_overlay.png, STEM_isomap.png and
/// STEM.json; and fits.csv. An image that cannot be used ends in problematic/STEM.txt and leaves the person alone.
/// Throws InvalidInput if none can be used, or for a perspective camera, which several images cannot have yet.
FitPersonSummary fit_person(const FitImagesOptions& options, const Progress& progress = {});

}  // namespace facewright
