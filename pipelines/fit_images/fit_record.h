// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "pipelines/fit_images/fit_images.h"
#include "pipelines/fit_images/fit_person.h"

namespace facewright {

/// All numbers of a fit as JSON text; angles in degrees. docs/fitting.md lists them.
std::string fit_json(const FittedImage& image, const FittedFace& face);

/// The shape that several images share and what each of them gave to it.
std::string person_json(const FitPersonSummary& person, const FittedFace& face);

/// A header and a line for each image, failures included, by RFC 4180: image, landmarks, fitted, pose in degrees,
/// pixels per mm, landmark error, coefficients. Columns of coefficients are as many as the longest has.
std::string fits_csv(const std::vector<FittedImage>& fits);

}  // namespace facewright
