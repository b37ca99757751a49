// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/image.h"

namespace facewright {

struct MergeOptions {
  bool compensate_gain = true;  ///< bring the images to one exposure and white balance
  double outlier = 0.08;        ///< distance from the weighted median at which a sample counts half, sRGB 0..1
  double sharpness = 2;         ///< exponent of alpha and resolution in the weights
};

struct MergeSummary {
  std::vector<Eigen::Vector3d> gains;  ///< per image and channel: its colours were multiplied by them (linear light)
  std::vector<double> shares;          ///< part of each image in the merged colours, adding up to 1
  double outlying = 0;                 ///< share of the samples that counted less than half
};
struct MergedTexture {
  Image isomap;  ///< RGBA; alpha is the largest of the images' alphas
  MergeSummary summary;
};

/// One isomap from several of the same face and size (RGBA, from extract_texture). Weights: (alpha *
/// resolution)^sharpness, `resolutions` being each one's TextureSummary::resolution (empty: all alike). Gains make the
/// images agree where they overlap: medians of the logarithm of the ratio per pair, joined by least squares, their mean
/// kept [brown2007]. With three or more samples at a texel, those far from the weighted median count little. O(images^2
/// * texels). Throws InvalidInput for no images, or sizes that differ.
MergedTexture merge_textures(const std::vector<Image>& isomaps, const std::vector<double>& resolutions = {},
                             const MergeOptions& options = {});

}  // namespace facewright
