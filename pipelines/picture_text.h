// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <string>

#include "libmodel/core/image.h"
#include "libmodel/render/overlays.h"

namespace facewright {

/// Writes a line of text into an image of 3 or 4 channels, top left corner of the first letter at `at` (pixels),
/// letters 5 x 7 dots of `dot` pixels each. Knows a-z, 0-9 and + - . , : % / ( ); capitals become small letters, what
/// else there is becomes a space. Parts outside the image are clipped.
void draw_text(Image& image, const Eigen::Vector2i& at, const std::string& text, const Rgb& colour, int dot = 2);

/// Width in pixels that draw_text needs.
int text_width(const std::string& text, int dot = 2);

}  // namespace facewright
