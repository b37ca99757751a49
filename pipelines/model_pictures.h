// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "libmodel/core/image.h"
#include "libmodel/core/mesh.h"
#include "libmodel/model/morphable_model.h"

namespace facewright {

// Pictures of a model, made with the software rasteriser. The same model and options give the same bytes for any number
// of threads. Sizes out of range throw InvalidInput.

struct ModelPictureOptions {
  int level = -1;                              ///< index of the level shown, -1 = finest
  int tile = 240;                              ///< width and height of one face, pixels, 32..2048
  std::vector<double> yaws_deg = {0, 35, 80};  ///< views of mean, modes and deviations, degrees, > 0: subject's left
  int threads = 0;                             ///< 0 = all
};

/// The mean from each side with its colours (if it has any), and below in clay.
Image mean_picture(const MorphableModel& model, const ModelPictureOptions& options = {});

enum class ModeFamily { shape, colour, expression };
struct ModePictureOptions {
  ModelPictureOptions faces = {.tile = 150};
  ModeFamily family = ModeFamily::shape;
  int modes = 5;     ///< the leading ones, >= 1; fewer if there are fewer
  double sigma = 3;  ///< standard deviations to either side, > 0
};
/// A row per mode with its share of the model's variance; for each view the face at -sigma, 0 and +sigma. Shapes and
/// expressions are shown in clay, colours without light. Throws InvalidInput if the model has no such modes.
Image mode_picture(const MorphableModel& model, const ModePictureOptions& options = {});

/// Random faces, six a row, coefficients N(0, sigma^2); face i does not depend on how many there are.
Image sample_picture(const MorphableModel& model, int count, double sigma, std::uint64_t seed,
                     const ModelPictureOptions& options = {});

/// The levels side by side as wireframes over clay, coarse to fine, each with its counts; below, nearer.
Image level_picture(const MorphableModel& model, const ModelPictureOptions& options = {.tile = 420});

/// Standard deviation of each vertex in the model's shape, mm: sqrt(sum over modes and axes of variance * entry^2),
/// dark to light from 0 to `range` mm (0 = the largest on the face), with the scale below. The mean's expressionless
/// shape carries it.
Image deviation_picture(const MorphableModel& model, double range_mm = 0, const ModelPictureOptions& options = {});

/// The texture map with the mean's colours and its triangles' edges, tile x tile pixels. Throws InvalidInput without
/// texture coordinates.
Image texture_map_picture(const MorphableModel& model, const ModelPictureOptions& options = {.level = 0, .tile = 512});

/// A full turn of a mesh in `frames` equal steps, starting from the front.
std::vector<Image> turntable(const Mesh& mesh, int frames, const ModelPictureOptions& options = {.tile = 480});

}  // namespace facewright
