// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/model_stage.h"

#include <algorithm>
#include <set>

#include "libmodel/core/errors.h"
#include "pipelines/drawing.h"
#include "pipelines/model_card.h"
#include "pipelines/scan_stage.h"
#include "pipelines/stored_model.h"

namespace facewright {
namespace {

std::vector<std::string> ids_of(const std::vector<ManifestEntry>& entries) {
  std::vector<std::string> ids;
  for (const ManifestEntry& e : entries) ids.push_back(e.id);
  return ids;
}

BuildModelOptions building_options(const BuildPipelineOptions& options) {
  BuildModelOptions building;
  building.variance_share = building.colour_variance_share = options.variance_share;
  building.scaling = options.scaling;
  building.prune_quantile = options.prune_quantile;
  building.gain_balance = options.gain_balance;
  building.threads = options.jobs;
  building.provenance["program"] = std::string("build-model ") + FACEWRIGHT_VERSION;
  return building;
}

std::string reason_of(const PrunedSample& sample, const PruneResult& prune) {
  return "pruned: its shape is an outlier: squared Mahalanobis distance " + std::to_string(sample.squared_mahalanobis) +
         " over " + std::to_string(prune.modes) + " modes, the limit is " + std::to_string(prune.threshold) +
         "; farthest out in mode " + std::to_string(sample.mode + 1) + ", " + std::to_string(sample.score) +
         " standard deviations. Look at its picture in scans/; --prune 0 keeps every scan";
}

// Why the scans that build_model left out are no part of the model.
std::map<std::string, std::string> pruned_scans(const PruneResult& pruned, const std::vector<ManifestEntry>& entries) {
  std::map<std::string, std::string> reasons;
  for (const PrunedSample& s : pruned.removed)
    reasons[entries[static_cast<size_t>(s.sample)].id] = reason_of(s, pruned);
  return reasons;
}

// The scans of those who have any with an expression: nobody else's tell what a face's movements are.
std::vector<ManifestEntry> expressive(const std::vector<ManifestEntry>& entries) {
  std::set<std::string> subjects;
  for (const ManifestEntry& e : entries)
    if (!e.neutral()) subjects.insert(e.subject);
  std::vector<ManifestEntry> theirs;
  std::copy_if(entries.begin(), entries.end(), std::back_inserter(theirs),
               [&](const ManifestEntry& e) { return subjects.contains(e.subject); });
  return theirs;
}

void add_expressions(ModelStageResult& result, const std::vector<ManifestEntry>& all, const MultiresTemplate& reference,
                     const BuildPipelineOptions& options, const OutputTree& tree) {
  const std::vector<ManifestEntry> entries = expressive(all);
  if (entries.empty()) return;
  if (plan_gathering(static_cast<int>(entries.size()), reference.V.rows(), options.memory).on_disk)
    throw InvalidInput("build: expressions are learnt in memory, and the " + std::to_string(entries.size()) +
                       " scans of those who have any do not fit; give more --memory, or name fewer in the manifest");
  std::vector<ExpressionLabel> labels;
  for (const ManifestEntry& e : entries) labels.push_back({e.subject, e.neutral() ? "" : e.expression});
  MorphableModelParts parts = result.built.model.parts();
  const RegisteredSet set = read_registered_set(ids_of(entries), reference, tree);
  ExpressionResult made = build_expressions(set, labels, reference, as_vertices(parts.shape.mean),
                                            {.variance_share = options.variance_share, .threads = options.jobs});
  parts.expression = std::move(made.expression);
  parts.blendshapes = std::move(made.blendshapes);
  result.expressions = std::move(made.summary);
  result.built.model = MorphableModel(std::move(parts));
}

}  // namespace

ModelStageResult model_stage(const std::vector<ManifestEntry>& entries,
                             const std::map<std::string, std::string>& left_out, const MultiresTemplate& reference,
                             const BuildPipelineOptions& options, const OutputTree& tree) {
  std::vector<ManifestEntry> neutral;
  std::copy_if(entries.begin(), entries.end(), std::back_inserter(neutral), [](const auto& e) { return e.neutral(); });
  if (static_cast<int>(neutral.size()) < options.least_scans)
    throw InvalidInput("build: " + std::to_string(neutral.size()) +
                       " scans with a neutral expression are left, at least " + std::to_string(options.least_scans) +
                       " are needed for a model");
  const BuildModelOptions building = building_options(options);
  const GatherPlan plan = plan_gathering(static_cast<int>(neutral.size()), reference.V.rows(), options.memory);
  ModelStageResult result;
  if (plan.on_disk) {
    result.built = build_stored_model(ids_of(neutral), reference, building, plan, tree);
  } else {
    result.scans = read_registered_set(ids_of(neutral), reference, tree);
    result.built = build_model(result.scans, reference, building);
  }
  std::vector<std::string> coloured;
  for (const int row : result.built.colour_scans) coloured.push_back(neutral[static_cast<size_t>(row)].id);
  result.pruned = pruned_scans(result.built.summary.pruned, neutral);
  std::erase_if(neutral, [&](const ManifestEntry& e) { return result.pruned.count(e.id) > 0; });
  if (plan.on_disk || !result.pruned.empty())
    result.scans = read_registered_set(draw_ids(ids_of(neutral), plan.at_hand), reference, tree);
  std::vector<ManifestEntry> kept = entries;
  std::erase_if(kept, [&](const ManifestEntry& e) { return result.pruned.count(e.id) > 0; });
  add_expressions(result, kept, reference, options, tree);

  ModelCardInput card;
  card.scans = kept;
  card.left_out = left_out;
  card.left_out.insert(result.pruned.begin(), result.pruned.end());
  card.has_manifest = options.has_manifest();
  card.shape_variance = result.built.summary.shape.total_variance;
  card.colour_variance = result.built.summary.colour.total_variance;
  card.terms = options.terms;
  card.coloured = std::move(coloured);
  card.fill = result.built.summary.fill;
  card.gains = result.built.summary.gains;
  result.card_markdown = model_card_markdown(result.built.model, card);
  result.card_json = model_card_json(result.built.model, card);
  result.built.model = result.built.model.with_provenance({{"model_card", result.card_json}});
  return result;
}

}  // namespace facewright
