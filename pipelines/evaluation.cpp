// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/evaluation.h"

#include <cmath>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

EvaluatedModel evaluate(MetricsInput input, const MetricsOptions& options, const Progress& progress) {
  EvaluatedModel result;
  const MetricsInput aligned = align_samples(std::move(input), options);
  result.compactness = compactness(aligned, options);
  result.generalisation = generalisation(aligned, options, progress);
  result.specificity = specificity(aligned, options, progress);
  return result;
}

EvaluatedSet read_and_evaluate(const std::string& name, const EvaluationSetOptions& set_options,
                               const MetricsOptions& options, const Progress& progress) {
  EvaluatedSet result = evaluate_set(name, read_evaluation_set(set_options), options, progress);
  result.folder = set_options.folder;
  return result;
}

std::vector<std::string> differences(const EvaluatedSet& a, const EvaluatedSet& b) {
  std::vector<std::string> list;
  const auto add = [&](const std::string& what, const std::string& x, const std::string& y) {
    list.push_back(what + ": " + y + ", of " + a.name + " " + x);
  };
  if (a.ids.size() != b.ids.size()) add("scans", std::to_string(a.ids.size()), std::to_string(b.ids.size()));
  if (a.vertices != b.vertices) add("vertices", std::to_string(a.vertices), std::to_string(b.vertices));
  if (a.ids.size() == b.ids.size() && a.ids != b.ids) list.push_back("other people than " + a.name);
  if (std::abs(a.area - b.area) > 0.02 * a.area)
    add("area of the mean, mm^2", std::to_string(std::lround(a.area)), std::to_string(std::lround(b.area)));
  return list;
}

}  // namespace

EvaluatedSet evaluate_set(const std::string& name, EvaluationSet set, const MetricsOptions& options,
                          const Progress& progress) {
  const Progress tell = [&](const ProgressEvent& event) {
    if (progress) progress({name + ": " + event.stage, event.done, event.total, event.item});
  };
  EvaluatedSet result;
  result.name = name;
  result.ids = set.ids;
  result.vertices = static_cast<int>(set.shapes.distance_weights.size());
  result.landmarks = static_cast<int>(set.shapes.landmarks.size());
  result.area = set.shapes.distance_weights.sum();
  result.shape = evaluate(std::move(set.shapes), options, tell);
  if (set.colours.samples.rows() > 0) {
    MetricsOptions colour = options;
    colour.alignment = FoldAlignment::none;
    colour.keep = 0;
    result.colour = evaluate(std::move(set.colours), colour, [&](const ProgressEvent& event) {
      tell({"colour " + event.stage, event.done, event.total, event.item});
    });
  }
  return result;
}

Evaluation evaluate_model(const EvaluationOptions& options, const Progress& progress) {
  Evaluation result;
  result.options = options;
  result.sets.push_back(read_and_evaluate(options.name, options.set, options.metrics, progress));
  for (const auto& [name, folder] : options.compare) {
    for (const EvaluatedSet& other : result.sets)
      if (other.name == name) throw InvalidInput("there are two sets called " + name);
    EvaluationSetOptions set = options.set;
    set.folder = folder;
    set.registered = false;
    set.truth.clear();
    MetricsOptions metrics = options.metrics;
    metrics.keep = 0;
    result.sets.push_back(read_and_evaluate(name, set, metrics, progress));
    result.sets.back().differences = differences(result.sets.front(), result.sets.back());
  }
  return result;
}

}  // namespace facewright
