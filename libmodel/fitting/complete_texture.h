// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

#include "libmodel/core/image.h"
#include "libmodel/model/morphable_model.h"
#include "libmodel/render/isomap_texels.h"

namespace facewright {

struct CompletionOptions {
  bool mirror = true;          ///< take hidden texels from the other side of the face where that was seen
  bool model = true;           ///< and the rest from the colour model
  double colour_sigma = 0.08;  ///< standard deviation of a vertex's colour about the model, linear RGB
  int observations = 300;      ///< independent ones that all visible vertices together count for
  double feather = 1.0 / 128;  ///< width of the blend inside sharp borders of the seen, share of the size
  int adaptation_texels = 4;   ///< colours are compared over blocks of this many texels along each side, 1..64
};

struct CompletionSummary {
  double seen = 0, mirrored = 0, modelled = 0;        ///< shares of the mapped texels; they add up to 1
  Eigen::VectorXd colour_coefficients;                ///< of the fit, standard deviations
  Eigen::Vector3d gain = Eigen::Vector3d::Ones();     ///< image over model, per channel
  bool has_mirror = false, has_colour_model = false;  ///< what the model offered
};

struct CompletedTexture {
  Image texture;  ///< (size x size) RGB, no holes; continued beyond the map's borders, so that filters find no seam
  Image sources;  ///< (size x size) RGB: shares of seen, mirrored and modelled colour, adding up to 255; 0 outside the
                  ///< map
  CompletionSummary summary;
};

enum class TexelSource { outside, seen, mirrored, modelled };
/// The largest share at a texel. Only `seen` was ever photographed there.
TexelSource texel_source(const Image& sources, int x, int y);

/// Fills the hidden texels of an isomap (RGBA as extract_texture or merge_textures gives it): from their mirror images
/// (model.mirror()), the colours adapted to the seen side by a smooth gain per channel; then from the colour model,
/// fitted to the seen vertices by MAP with a gain per channel and outliers weighted down, adapted in the same way, so
/// that no border shows. Without a colour model the rest is spread smoothly from what is there, and counts as modelled
/// all the same: it was not seen. `texels` are those of the level's uv. Where too little was seen to fill anything
/// with and the model has no colour, both images are empty. Throws InvalidInput if sizes do not agree.
CompletedTexture complete_texture(const MorphableModel& model, int level, const Image& isomap,
                                  const IsomapTexels& texels, const CompletionOptions& options = {});

}  // namespace facewright
