// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "libmodel/building/fill_unseen.h"
#include "libmodel/io/manifest.h"
#include "libmodel/model/morphable_model.h"

namespace facewright {

/// What a model card needs besides the model.
struct ModelCardInput {
  std::vector<ManifestEntry> scans;             ///< in the model; without a manifest only their ids
  std::map<std::string, std::string> left_out;  ///< id to the reason
  bool has_manifest = false;
  double variance_share = 0.99;
  double shape_variance = 0, colour_variance = 0;  ///< total, mm^2 and linear RGB^2
  std::vector<std::string> coloured;  ///< ids of the scans in the colour model, which fill and gains speak of
  FillUnseenSummary fill;             ///< what was done about colours nobody saw
  Eigen::MatrixXd gains;              ///< (S x 3) of balanced colours, or empty
  std::string terms;                  ///< licence and consent, as the user states them; may be empty
};

/// A model card [mitchell2019] with the table of people of [huber2016]: who is in the model (people, scans, groups,
/// ages in the paper's classes 0-19, 20-29, 30-44, 45-59, 60+, expressions), what was left out and why, what
/// share of the colours was filled in, what the numbers mean, and what the model should not be used for. Things nobody
/// stated are said to be not stated.
std::string model_card_markdown(const MorphableModel& model, const ModelCardInput& input);
/// The same as JSON text.
std::string model_card_json(const MorphableModel& model, const ModelCardInput& input);

}  // namespace facewright
