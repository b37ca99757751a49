// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <array>
#include <cstdint>

#include "libmodel/core/camera.h"
#include "libmodel/core/image.h"
#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"

namespace facewright {

/// sRGB bytes.
using Rgb = std::array<std::uint8_t, 3>;

// Marks drawn into an image of 3 or 4 channels, antialiased; positions in pixels, parts outside are clipped.

void draw_disc(Image& image, const Eigen::Vector2d& centre, double radius, const Rgb& colour, double opacity = 1);
void draw_line(Image& image, const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Rgb& colour, double width = 1,
               double opacity = 1);
/// An upright cross of arm length `radius`.
void draw_cross(Image& image, const Eigen::Vector2d& centre, double radius, const Rgb& colour, double width = 1);
void draw_landmarks(Image& image, const ImageLandmarks& landmarks, double radius, const Rgb& colour);

/// The visible edges of a mesh (hidden lines removed), about one pixel wide.
void draw_wireframe(Image& image, const Vertices& V, const Faces& F, const AffineCamera& camera, const Rgb& colour,
                    double opacity = 0.5);
void draw_wireframe(Image& image, const Vertices& V, const Faces& F, const PerspectiveCamera& camera, const Rgb& colour,
                    double opacity = 0.5);

/// An RGB copy of any image: grey repeated, alpha dropped.
Image to_rgb(const Image& image);

}  // namespace facewright
