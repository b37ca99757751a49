// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

#include "libmodel/fitting/fit_model.h"
#include "pipelines/fit_images/fit_images.h"

namespace facewright {

/// What a page shows beside the face.
struct FitPage {
  std::string title;
  std::vector<std::pair<std::string, Image>> pictures;  ///< caption and picture; large ones are made smaller
  std::vector<FitNumbers> fits;                         ///< one per image, or one of a single image
  std::vector<std::string> names;                       ///< of the images, as many
};

/// One file that shows a fit: the face in three dimensions with its completed texture, to turn and to save; pictures;
/// pose, landmark error and coefficients. It needs nothing else. Without three.js at build time the face is missing.
std::string fit_page(const FittedFace& face, const FitPage& page);

}  // namespace facewright
