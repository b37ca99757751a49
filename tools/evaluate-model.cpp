// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <charconv>

#include "libmodel/core/errors.h"
#include "pipelines/evaluation.h"
#include "tools/cli.h"
using namespace facewright;

namespace {

// "loo" or a number of folds.
int parse_folds(const std::string& text) {
  if (text == "loo") return 0;
  int folds = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), folds);
  if (error != std::errc() || end != text.data() + text.size() || folds < 2)
    throw CLI::ValidationError("--folds: expected loo or a number from 2, not " + text);
  return folds;
}

std::pair<std::string, std::filesystem::path> parse_compare(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw CLI::ValidationError("--compare: expected NAME=FOLDER, not " + text);
  return {text.substr(0, equals), text.substr(equals + 1)};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Compactness, generalisation and specificity of a model, from the registered scans it was built from.\n"
      "Writes evaluation.json, CSV tables and SVG plots.",
      "evaluate-model");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::output | CommonFlags::jobs | CommonFlags::seed,
                     "evaluate-model my-model -o my-model/evaluation --compare other=other-model");
  EvaluationOptions options;
  std::string folds = "loo";
  std::vector<std::string> compare;
  bool no_colour = false;
  app.add_option("input", options.set.folder, "Output folder of build-model, or a folder of meshes in correspondence")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_flag("--registered", options.set.registered, "The folder holds the meshes themselves (.ply, .obj)");
  app.add_option("--name", options.name, "What tables and plots call the set");
  app.add_option("--compare", compare,
                 "NAME=FOLDER: another set, measured in the same way and shown beside; repeatable");
  app.add_option("--truth", options.set.truth,
                 "Folder of meshes with the same names and vertices: reconstructions are held against these too")
      ->check(CLI::ExistingDirectory);
  app.add_option("--folds", folds, "Generalisation leaves out one scan at a time (loo) or one of so many folds");
  app.add_option("--modes", options.metrics.modes, "Mode counts to measure at, like 1,2,5,10; all by default")
      ->delimiter(',')
      ->check(CLI::NonNegativeNumber);
  app.add_option("--samples", options.metrics.samples, "Random faces for specificity")->check(CLI::Range(0, 10000000));
  app.add_option("--surface-samples", options.metrics.surface_samples,
                 "Of these, how many are measured to surfaces too")
      ->check(CLI::Range(0, 1000000));
  app.add_option("--surface-vertices", options.metrics.surface_vertices,
                 "Vertices at which surface distances are taken; 0 = no surface distances")
      ->check(CLI::Range(0, 10000000));
  const std::map<std::string, FoldAlignment> alignments = {{"shared", FoldAlignment::shared},
                                                           {"per-fold", FoldAlignment::per_fold}};
  app.add_option("--alignment", options.metrics.alignment,
                 "shared: all scans once, left-out ones then onto the mean of the others; per-fold: anew without them")
      ->transform(CLI::CheckedTransformer(alignments).description("{shared,per-fold}"))
      ->default_str("shared");
  const std::map<std::string, Scaling> scalings = {{"fixed", Scaling::fixed}, {"free", Scaling::free}};
  app.add_option("--scaling", options.metrics.scaling, "Whether alignment removes head size (free) or not (fixed)")
      ->transform(CLI::CheckedTransformer(scalings).description("{fixed,free}"))
      ->default_str("fixed");
  app.add_option("--rim-weight", options.set.rim_weight, "Weight of the model's region \"rim\" in alignments")
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--level", options.set.level,
                 "Vertex count of the level, or its index from 0, the coarsest; -1 = finest")
      ->check(CLI::Range(-1, 1 << 30).description(""));
  app.add_flag("--no-colour", no_colour, "Shape only");
  app.add_option("--keep-reconstructions", options.metrics.keep,
                 "Write the left-out reconstructions of the first so many scans, with all modes")
      ->check(CLI::Range(0, 100000));
  return run_program(argc, argv, app, common, [&] {
    options.metrics.folds = parse_folds(folds);
    for (const std::string& text : compare) options.compare.push_back(parse_compare(text));
    options.set.colours = !no_colour;
    options.metrics.seed = common.seed;
    options.metrics.threads = options.set.threads = common.jobs;
    ProgressBar bar(common);
    const Evaluation evaluation = evaluate_model(options, bar.progress());
    write_evaluation(common.output, evaluation);
    report(common, describe_evaluation(evaluation) + "evaluate-model: wrote " + common.output.string());
    return ExitCode::ok;
  });
}
