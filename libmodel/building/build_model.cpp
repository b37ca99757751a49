// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/build_model.h"

#include <numeric>

#include "libmodel/core/errors.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

void check(const RegisteredSet& scans, const MultiresTemplate& reference, const BuildModelOptions& options) {
  const auto expect = [](bool ok, const std::string& what) {
    if (!ok) throw InvalidInput("build model: " + what);
  };
  expect(scans.scan_count() > 0, "there are no registered scans");
  expect(scans.vertex_count() == reference.V.rows(), "scans have " + std::to_string(scans.vertex_count()) +
                                                         " vertices, the reference " +
                                                         std::to_string(reference.V.rows()));
  expect(scans.colours.size() == 0 ||
             (scans.colours.rows() == scans.shapes.rows() && scans.colours.cols() == scans.shapes.cols()),
         "colours and shapes differ in size");
  expect(options.first_level >= 0 && options.first_level < static_cast<int>(reference.levels.size()),
         "first_level is " + std::to_string(options.first_level) + ", the reference has " +
             std::to_string(reference.levels.size()) + " levels");
  expect(options.rim_weight >= 0 && options.rim_weight <= 1, "rim_weight must be within 0..1");
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

}  // namespace

BuildModelResult build_model(const RegisteredSet& scans, const MultiresTemplate& reference,
                             const BuildModelOptions& options, const Progress& progress) {
  check(scans, reference, options);
  const auto tell = [&](int done, const char* item) {
    if (progress) progress({"model", done, 3, item});
  };
  BuildModelResult result;
  BuildModelSummary& summary = result.summary;
  MorphableModelParts parts = parts_of(reference, options.first_level);

  ProcrustesResult aligned =
      generalised_procrustes(scans.shapes, procrustes_weights(reference, options.rim_weight), reference.V,
                             {.scaling = options.scaling, .threads = options.threads});
  summary.procrustes = aligned.summary;
  result.mean_from_scans = std::move(aligned.mean_from_scans);
  tell(1, "alignment");

  PcaOptions pca;
  pca.threads = options.threads;
  pca.max_modes = options.max_modes;
  pca.variance_share = options.variance_share;
  PcaResult shape = fit_pca(aligned.shapes, pca);
  summary.shape = shape.summary;
  summary.shape_shares = cumulative_shares(shape.model, shape.summary.total_variance);
  result.shape_scores = std::move(shape.scores);
  parts.shape = std::move(shape.model);
  tell(2, "shape");

  if (scans.colours.size() > 0) {
    pca.variance_share = options.colour_variance_share;
    PcaResult colour;
    if (scans.visibility.size() > 0) {
      FillUnseenOptions fill = options.fill;
      fill.threads = options.threads;
      FillUnseenResult filled = fill_unseen(scans.colours, scans.visibility, fill);
      summary.fill = filled.summary;
      colour = fit_pca(filled.values, pca);
    } else {
      colour = fit_pca(scans.colours, pca);
    }
    summary.colour = colour.summary;
    summary.colour_shares = cumulative_shares(colour.model, colour.summary.total_variance);
    result.colour_scores = std::move(colour.scores);
    parts.colour = std::move(colour.model);
  }
  tell(3, "colour");
  parts.provenance = options.provenance;
  result.model = MorphableModel(std::move(parts));
  return result;
}

}  // namespace facewright
