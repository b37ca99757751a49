// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/build_model.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "libmodel/building/pca_out_of_core.h"
#include "libmodel/core/errors.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

void expect(bool ok, const std::string& what) {
  if (!ok) throw InvalidInput("build model: " + what);
}

void check(Eigen::Index scans, Eigen::Index vertices, const MultiresTemplate& reference,
           const BuildModelOptions& options) {
  expect(scans > 0, "there are no registered scans");
  expect(vertices == reference.V.rows(),
         "scans have " + std::to_string(vertices) + " vertices, the reference " + std::to_string(reference.V.rows()));
  expect(options.first_level >= 0 && options.first_level < static_cast<int>(reference.levels.size()),
         "first_level is " + std::to_string(options.first_level) + ", the reference has " +
             std::to_string(reference.levels.size()) + " levels");
  expect(options.rim_weight >= 0 && options.rim_weight <= 1, "rim_weight must be within 0..1");
  expect(options.prune_quantile >= 0 && options.prune_quantile < 1, "prune_quantile must be 0 (off) or below 1");
}

Eigen::VectorXd procrustes_weights(const MultiresTemplate& reference, double rim_weight) {
  Eigen::VectorXd weights = vertex_areas(reference.V, reference.levels.back().F);
  const auto rim = reference.regions.find("rim");
  if (rim != reference.regions.end())
    for (int v : rim->second) weights[v] *= rim_weight;
  return weights;
}

std::vector<double> cumulative_shares(const PcaModel& model, double total) {
  std::vector<double> shares(static_cast<size_t>(model.mode_count()));
  std::partial_sum(model.variances.begin(), model.variances.end(), shares.begin());
  for (double& share : shares) share /= total;
  return shares;
}

MorphableModelParts parts_of(const MultiresTemplate& reference, int first_level) {
  MorphableModelParts parts;
  for (size_t l = static_cast<size_t>(first_level); l < reference.levels.size(); ++l)
    parts.levels.push_back(
        {reference.levels[l].vertex_count, reference.levels[l].F, landmark_points(reference, static_cast<int>(l))});
  // For those who know vertices only: the nearest one of the model's coarsest level, the same at every level.
  const Faces& coarsest = parts.levels.front().F;
  LandmarkSet marks = reference.landmarks;
  for (const auto& [name, point] : parts.levels.front().landmark_points) marks[name] = {point, -1};
  parts.landmarks = landmarks_on_vertices(marks, coarsest, coarsest);
  parts.mirror = reference.mirror;
  parts.parents = reference.parents;
  parts.base_faces = reference.levels.front().F;
  parts.regions = reference.regions;
  return parts;
}

SampleMatrix rows_of(const SampleMatrix& X, const std::vector<int>& rows) {
  return X.size() == 0 ? SampleMatrix() : SampleMatrix(X(rows, Eigen::all));
}

std::vector<int> first_integers(Eigen::Index n) {
  std::vector<int> rows(static_cast<size_t>(n));
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

ProcrustesOptions alignment_options(const BuildModelOptions& options) {
  return {.scaling = options.scaling, .unseen_weight = options.unseen_weight, .threads = options.threads};
}

PcaOptions pca_options(const BuildModelOptions& options, double share) {
  PcaOptions pca;
  pca.variance_share = share;
  pca.max_modes = options.max_modes;
  pca.solver = options.solver;
  pca.threads = options.threads;
  return pca;
}

// As many modes as pruning looks at, whatever the model keeps.
PcaOptions pruning_pca(const BuildModelOptions& options) {
  PcaOptions pca = pca_options(options, 1);
  pca.max_modes = options.prune_modes;
  return pca;
}

PruneOptions prune_options(const BuildModelOptions& options) { return {options.prune_quantile, options.prune_modes}; }

void take_shape(PcaResult shape, MorphableModelParts* parts, BuildModelResult* result) {
  result->summary.shape = shape.summary;
  result->summary.shape_shares = cumulative_shares(shape.model, shape.summary.total_variance);
  result->shape_scores = std::move(shape.scores);
  parts->shape = std::move(shape.model);
}

void take_colour(PcaResult colour, MorphableModelParts* parts, BuildModelResult* result) {
  result->summary.colour = colour.summary;
  result->summary.colour_shares = cumulative_shares(colour.model, colour.summary.total_variance);
  result->colour_scores = std::move(colour.scores);
  parts->colour = std::move(colour.model);
}

// Whether these are some of all, in their order.
bool is_part_of(const std::vector<std::string>& some, const std::vector<std::string>& all) {
  auto at = all.begin();
  for (const std::string& id : some) {
    at = std::find(at, all.end(), id);
    if (at == all.end()) return false;
    ++at;
  }
  return true;
}

// Rows whose colour was seen anywhere.
std::vector<int> coloured(const std::vector<int>& rows, const SampleMatrix& weights) {
  std::vector<int> list;
  std::copy_if(rows.begin(), rows.end(), std::back_inserter(list),
               [&](int row) { return weights.size() == 0 || weights.row(row).maxCoeff() > 0; });
  return list;
}

void add_colour(const RegisteredSet& scans, const MultiresTemplate& reference, const BuildModelOptions& options,
                MorphableModelParts* parts, BuildModelResult* result) {
  if (scans.colours.size() == 0) return;
  const SampleMatrix& weights = scans.colour_weights.size() > 0 ? scans.colour_weights : scans.visibility;
  result->colour_scans = coloured(result->scans, weights);
  if (result->colour_scans.empty()) return;
  SampleMatrix colours = rows_of(scans.colours, result->colour_scans);
  const SampleMatrix seen = rows_of(weights, result->colour_scans);
  if (options.gain_balance != GainBalance::none) {
    GainBalanceResult balanced =
        balance_gains(std::move(colours), seen, {.balance = options.gain_balance, .threads = options.threads});
    colours = std::move(balanced.colours);
    result->summary.gains = std::move(balanced.gains);
  }
  if (seen.size() > 0) {
    FillUnseenOptions fill = options.fill;
    fill.threads = options.threads;
    FillUnseenResult filled = fill_unseen(std::move(colours), seen, reference.V, reference.levels.back().F, fill);
    result->summary.fill = filled.summary;
    colours = std::move(filled.values);
  }
  take_colour(fit_pca(colours, pca_options(options, options.colour_variance_share)), parts, result);
}

}  // namespace

BuildModelResult build_model(const RegisteredSet& scans, const MultiresTemplate& reference,
                             const BuildModelOptions& options, const Progress& progress) {
  check(scans.scan_count(), scans.vertex_count(), reference, options);
  expect(scans.colours.size() == 0 ||
             (scans.colours.rows() == scans.shapes.rows() && scans.colours.cols() == scans.shapes.cols()),
         "colours and shapes differ in size");
  expect(scans.colour_weights.size() == 0 ||
             (scans.colour_weights.rows() == scans.scan_count() && scans.colour_weights.cols() == scans.vertex_count()),
         "colour weights and shapes differ in size");
  const auto tell = [&](int done, const char* item) {
    if (progress) progress({"model", done, 3, item});
  };
  BuildModelResult result;
  MorphableModelParts parts = parts_of(reference, options.first_level);
  const Eigen::VectorXd weights = procrustes_weights(reference, options.rim_weight);
  const auto align = [&](const SampleMatrix& shapes, const SampleMatrix& visibility) {
    return generalised_procrustes(shapes, weights, reference.V, alignment_options(options), visibility);
  };
  ProcrustesResult aligned = align(scans.shapes, scans.visibility);
  result.scans = first_integers(scans.scan_count());
  if (options.prune_quantile > 0) {
    result.summary.pruned = find_outliers(fit_pca(aligned.shapes, pruning_pca(options)).scores, prune_options(options));
    result.scans = result.summary.pruned.kept;
    if (!result.summary.pruned.removed.empty())
      aligned = align(rows_of(scans.shapes, result.scans), rows_of(scans.visibility, result.scans));
  }
  result.summary.procrustes = aligned.summary;
  result.mean_from_scans = std::move(aligned.mean_from_scans);
  tell(1, "alignment");

  take_shape(fit_pca(aligned.shapes, pca_options(options, options.variance_share)), &parts, &result);
  tell(2, "shape");

  add_colour(scans, reference, options, &parts, &result);
  tell(3, "colour");
  parts.provenance = options.provenance;
  result.model = MorphableModel(std::move(parts));
  return result;
}

BuildModelResult build_model(SampleStore& shapes, SampleStore* colours, const MultiresTemplate& reference,
                             const BuildModelOptions& options, const SampleVisibility& visibility,
                             const Progress& progress) {
  check(shapes.sample_count(), shapes.cols() / 3, reference, options);
  expect(colours == nullptr || (colours->cols() == shapes.cols() && is_part_of(colours->ids(), shapes.ids())),
         "colours and shapes differ in size or ids");
  BuildModelResult result;
  MorphableModelParts parts = parts_of(reference, options.first_level);
  const Eigen::VectorXd weights = procrustes_weights(reference, options.rim_weight);
  const std::vector<std::string> given = shapes.ids();
  std::set<std::string> with_colour;
  if (colours != nullptr) with_colour.insert(colours->ids().begin(), colours->ids().end());
  const auto align = [&] {
    return realign(shapes, weights, reference.V, alignment_options(options), visibility, progress);
  };
  result.summary.procrustes = align();
  result.scans = first_integers(shapes.sample_count());
  if (options.prune_quantile > 0) {
    const PruneResult& pruned = result.summary.pruned =
        find_outliers(fit_pca(shapes, pruning_pca(options), progress).scores, prune_options(options));
    result.scans = pruned.kept;
    std::vector<std::string> ids, of_colours;
    for (const PrunedSample& sample : pruned.removed) {
      ids.push_back(given[static_cast<size_t>(sample.sample)]);
      if (with_colour.contains(ids.back())) of_colours.push_back(ids.back());
    }
    if (!ids.empty()) {
      shapes.remove(ids);
      result.summary.procrustes = align();
    }
    if (!of_colours.empty()) colours->remove(of_colours);
  }
  for (Eigen::Index i = 0; i < shapes.sample_count(); ++i) result.mean_from_scans.push_back(shapes.mean_from_scan(i));
  take_shape(fit_pca(shapes, pca_options(options, options.variance_share), progress), &parts, &result);
  if (colours != nullptr && colours->sample_count() > 0) {
    for (const int row : result.scans)
      if (with_colour.contains(given[static_cast<size_t>(row)])) result.colour_scans.push_back(row);
    take_colour(fit_pca(*colours, pca_options(options, options.colour_variance_share), progress), &parts, &result);
  }
  parts.provenance = options.provenance;
  result.model = MorphableModel(std::move(parts));
  return result;
}

}  // namespace facewright
