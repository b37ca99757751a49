// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "libmodel/building/metrics.h"
#include "libmodel/core/progress.h"
#include "pipelines/evaluation_set.h"

namespace facewright {

struct EvaluationOptions {
  EvaluationSetOptions set;                                            ///< what is evaluated
  std::string name = "model";                                          ///< its name in tables and plots
  std::vector<std::pair<std::string, std::filesystem::path>> compare;  ///< name, folder: sets measured in the same way
  MetricsOptions metrics;                                              ///< alignment applies to shapes
};

/// The three quantities of one kind of data (shapes or colours) of one set.
struct EvaluatedModel {
  CompactnessResult compactness;
  GeneralisationResult generalisation;
  SpecificityResult specificity;
};

struct EvaluatedSet {
  std::string name;
  std::filesystem::path folder;
  std::vector<std::string> ids;
  int vertices = 0, landmarks = 0;
  double area = 0;  ///< mm^2 of the mean: tells whether sets are cropped alike
  EvaluatedModel shape;
  std::optional<EvaluatedModel> colour;
  std::vector<std::string> differences;  ///< from the first set: why curves must not be compared; empty if they may
};

struct Evaluation {
  std::vector<EvaluatedSet> sets;  ///< the evaluated one first
  EvaluationOptions options;
};

/// Compactness, generalisation and specificity of registered scans (libmodel/building/metrics.h), of sets one after the
/// other.
Evaluation evaluate_model(const EvaluationOptions& options, const Progress& progress = {});

/// The same of one set that is at hand.
EvaluatedSet evaluate_set(const std::string& name, EvaluationSet set, const MetricsOptions& options,
                          const Progress& progress = {});

/// Writes evaluation.json, compactness.csv, generalisation.csv, specificity.csv and one .svg per measure into `folder`,
/// and the left-out reconstructions that were kept as reconstructions/ID.ply beside it.
void write_evaluation(const std::filesystem::path& folder, const Evaluation& evaluation);

/// A table for people: values of each set at some mode counts, and ratios to the other sets.
std::string describe_evaluation(const Evaluation& evaluation);

}  // namespace facewright
