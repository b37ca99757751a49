// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// A folder of scans to a multi-resolution morphable model.
#include <cstdio>
#include <iostream>

#include "libmodel/core/errors.h"
#include "pipelines/build_pipeline.h"
#include "tools/scan_flags.h"

using namespace facewright;

namespace {

DenoiseMethod denoise_from_name(const std::string& name) {
  if (name == "gauss") return DenoiseMethod::gaussian;
  if (name == "median") return DenoiseMethod::median;
  if (name == "bilateral") return DenoiseMethod::bilateral;
  if (name == "none") return DenoiseMethod::none;
  return DenoiseMethod::automatic;
}

LevelCriterion criterion_from_name(const std::string& name) {
  if (name == "bend") return LevelCriterion::bend;
  if (name == "length") return LevelCriterion::length;
  return LevelCriterion::deviation;
}

// For CLI11: what is wrong with a word of --levels, or nothing.
std::string check_level(const std::string& word) {
  const bool count = !word.empty() && word.size() < 10 && word.find_first_not_of("0123456789") == std::string::npos;
  return count || word == "surrey" ? "" : "expected vertex counts or the preset surrey, got " + word;
}

std::vector<int> levels_from(const std::vector<std::string>& words) {
  if (words == std::vector<std::string>{"surrey"}) return kSurreyLevels;
  std::vector<int> levels;
  for (const std::string& word : words) {
    if (word == "surrey") throw InvalidInput("levels: the preset surrey stands alone");
    levels.push_back(std::stoi(word));
  }
  return levels;
}

BuildStage stage_from_name(const std::string& name) {
  if (name == "landmarks") return BuildStage::landmarks;
  if (name == "levels") return BuildStage::levels;
  return name == "registration" ? BuildStage::registration : BuildStage::model;
}

BuildPart part_from(const std::string& text) {
  BuildPart part;
  const size_t slash = text.find('/');
  if (slash != text.npos) part = {std::stoi(text.substr(0, slash)), std::stoi(text.substr(slash + 1))};
  return part;
}

// For CLI11, as check_level.
std::string check_part(const std::string& text) {
  int number = 0, count = 0, length = 0;
  const bool read = text.size() < 16 && std::sscanf(text.c_str(), "%d/%d%n", &number, &count, &length) == 2 &&
                    length == static_cast<int>(text.size());
  return read && number >= 1 && number <= count ? "" : "expected i/n with 1 <= i <= n, got " + text;
}

// What a run that stops before the model has done.
void print_stage(const CommonOptions& common, const BuildPipelineSummary& s, BuildStage until) {
  const LandmarkStageSummary& marks = s.landmarks;
  if (until == BuildStage::landmarks)
    report(common, "build-model: landmarks: of " + std::to_string(marks.given) + " scans given, of " +
                       std::to_string(marks.found) + " found, of " + std::to_string(marks.completed) +
                       " completed, of " + std::to_string(marks.by_hand) + " by hand, of " +
                       std::to_string(marks.failed.size()) + " none");
  if (until == BuildStage::levels) report(common, "build-model: the levels are decided");
  if (until == BuildStage::registration)
    report(common, "build-model: " + std::to_string(s.registered) + " of " + std::to_string(s.scans.size()) +
                       " scans registered");
}

void print_failures(const BuildPipelineSummary& s) {
  for (const ScanOutcome& o : s.scans)
    if (!o.registered) std::cerr << "build-model: " << o.id << " left out: " << o.reason << "\n";
  if (s.scans.empty())
    for (const auto& [id, reason] : s.landmarks.failed) std::cerr << "build-model: " << id << ": " << reason << "\n";
}

void print_summary(const CommonOptions& common, const BuildPipelineSummary& s) {
  std::string levels;
  for (const int v : s.level_vertices) levels += (levels.empty() ? "" : ", ") + std::to_string(v);
  report(common, "build-model: " + std::to_string(s.registered) + " of " + std::to_string(s.scans.size()) +
                     " scans registered; " + std::to_string(s.shape_modes) + " shape and " +
                     std::to_string(s.colour_modes) + " colour modes; levels " + levels);
  const LandmarkStageSummary& marks = s.landmarks;
  if (marks.found + marks.completed + marks.by_hand > 0)
    report(common, "build-model: landmarks: of " + std::to_string(marks.found) + " scans found, of " +
                       std::to_string(marks.completed) + " completed, of " + std::to_string(marks.by_hand) +
                       " by hand; look at the pictures in " + (common.output / "landmarks").string() +
                       " and correct with landmark-scan --edit");
  for (const auto& [id, reason] : s.pruned) std::cerr << "build-model: " << id << " " << reason << "\n";
  for (const std::string& who : s.without_neutral)
    std::cerr << "build-model: " << who << " has expressions but no neutral scan that could be used: no part of them\n";
  if (!s.blendshapes.empty())
    report(common, "build-model: " + std::to_string(s.blendshapes.size()) + " expressions by name, " +
                       std::to_string(s.expression_modes) + " modes of expression");
  if (s.levels.too_few_scans)
    std::cerr << "build-model: too few scans could be registered to decide the levels by; the reference's own shape "
                 "decided\n";
  for (const auto& [stage, seconds] : s.seconds) detail(common, "  " + stage + ": " + format_duration(seconds));
  if (s.nothing_changed) report(common, "build-model: nothing has changed since the last run; no file was written");
  report(common, "build-model: the model is " + (common.output / "model.h5").string() + "; open " +
                     (common.output / "report" / "index.html").string());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Builds a multi-resolution 3D morphable face model from a folder of scans.", "build-model");
  CommonOptions common;
  add_common_options(app, common,
                     CommonFlags::output | CommonFlags::jobs | CommonFlags::seed | CommonFlags::units |
                         CommonFlags::axes | CommonFlags::resume,
                     "build-model scans -o model -j 2");
  BuildPipelineOptions options;
  std::string denoise = "auto", gpa = "rigid", gains = "none", criterion = "deviation", reference, reference_landmarks,
              landmark_names;
  std::vector<std::string> levels = {"surrey"};
  std::string until = "model", part;
  bool no_mirror = false, no_landmarking = false, asymmetric = false, own_shape = false;
  app.add_option(
         "scans", options.scans,
         "Folder of scans (OBJ, PLY, STL, OFF, glTF), with ID.json, .pts, .pp, .mrk.json, .fcsv or .ljson beside those "
         "whose landmarks are known; or a manifest: CSV with a column file, and id, landmarks, subject, expression, "
         "group, age, units")
      ->required();
  app.add_option("--levels", levels, "Vertex counts of the model's levels, increasing; surrey: 3448,16759,29587")
      ->delimiter(',')
      ->check(check_level);
  app.add_option(
         "--criterion", criterion,
         "What decides which edges are split first: deviation of the registered scans from the coarser surface, "
         "or edge length of the reference, alone or with bend")
      ->check(CLI::IsMember({"deviation", "bend", "length"}));
  app.add_flag("--keep-reference-shape", own_shape,
               "Register to the reference's own shape instead of the mean of some first registrations");
  app.add_flag("--asymmetric", asymmetric, "Refine left and right independently");
  app.add_option("--variance", options.variance_share, "Share of the variance kept in shape and colour")
      ->check(CLI::Range(0.01, 1.0));
  app.add_option("--gpa", gpa, "Alignment before the statistics; rigid keeps the size of heads in the model")
      ->check(CLI::IsMember({"rigid", "similarity"}));
  app.add_option(
         "--gain-balance", gains,
         "Divide each scan's colours by a gain towards the mean, one for all or one per channel: for scans taken "
         "under different light; it takes differences of skin tone with it")
      ->check(CLI::IsMember({"none", "exposure", "channels"}));
  app.add_option("--prune", options.prune_quantile,
                 "Leave out shapes beyond this quantile of chi-squared, such as 0.99, and list them; 0: keep all")
      ->check(CLI::Range(0.0, 0.9999999));
  app.add_option("--exclude", options.exclude, "Ids of scans to leave out")->delimiter(',');
  app.add_option("--terms", options.terms, "Licence and consent of the scans, for the model card");
  app.add_option("--denoise", denoise, "Noise filter")
      ->check(CLI::IsMember({"auto", "gauss", "median", "bilateral", "none"}));
  app.add_option(
         "--slide", options.registration.global.slide,
         "Landmarks of jaw, brows, lids and lips are this many times less certain along their curve; 1: as certain")
      ->check(CLI::Range(1.0, 100.0));
  app.add_option("--landmark-stddev", options.registration.landmark_stddev,
                 "Precision of landmarks that state none, mm")
      ->check(CLI::Range(0.01, 20.0));
  app.add_option("--landmark-names", landmark_names,
                 "What the names in the landmark files mean, if they are not ibug's: a mapping file")
      ->check(CLI::ExistingFile);
  app.add_flag("--no-landmarking", no_landmarking,
               "Find no landmarks: scans without a landmark file are left out, names that a file lacks are missing");
  app.add_flag("--no-mirror", no_mirror, "Do not fill unseen parts from the other side of the face");
  app.add_option("--reference", reference,
                 "Your own reference instead of the built-in face: a file of make-reference, or a mesh with")
      ->check(CLI::ExistingFile);
  app.add_option("--reference-landmarks", reference_landmarks, "its landmarks, if it is a mesh")
      ->check(CLI::ExistingFile);
  app.add_option("--memory", options.memory,
                 "Keep within so many gigabytes, 0 = no limit: fewer jobs, and the model through files on the disk")
      ->check(CLI::NonNegativeNumber)
      ->configurable(false);
  app.add_option("--until", until,
                 "Stop after this stage; landmarks and registration can be done in parts side by side, the others once")
      ->check(CLI::IsMember({"landmarks", "levels", "registration", "model"}))
      ->configurable(false);
  app.add_option("--part", part, "Only every n-th scan, as in 2/8; with --until landmarks or registration")
      ->check(check_part)
      ->configurable(false)
      ->type_name("i/n");
  return run_program(argc, argv, app, common, [&] {
    options.until = stage_from_name(until);
    options.part = part_from(part);
    options.output = common.output;
    options.jobs = common.jobs;
    options.seed = common.seed;
    options.resume = common.resume;
    options.scan = scan_options(common);
    if (!landmark_names.empty()) options.scan.landmark_names = landmark_names;
    options.registration.denoise.method = denoise_from_name(denoise);
    options.find_landmarks = !no_landmarking;
    options.registration.use_mirror = !no_mirror;
    options.levels = levels_from(levels);
    options.criterion = criterion_from_name(criterion);
    options.gain_balance = gains == "exposure"   ? GainBalance::exposure
                           : gains == "channels" ? GainBalance::channels
                                                 : GainBalance::none;
    options.scaling = gpa == "similarity" ? Scaling::free : Scaling::fixed;
    options.symmetric = !asymmetric;
    options.mean_as_reference = !own_shape;
    options.reference = reference;
    options.reference_landmarks = reference_landmarks;
    ProgressBar bar(common);
    const BuildPipelineSummary summary = build_from_scans(options, bar.progress());
    print_failures(summary);
    if (options.until == BuildStage::model)
      print_summary(common, summary);
    else
      print_stage(common, summary, options.until);
    return summary.failed > 0 || (summary.scans.empty() && !summary.landmarks.failed.empty()) ? ExitCode::some_failed
                                                                                              : ExitCode::ok;
  });
}
