// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/build_record.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "libmodel/core/parallel.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/sha256.h"
#include "pipelines/json_text.h"
#include "pipelines/scan_stage.h"
#include "pipelines/stored_model.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr const char* kFormat = "facewright-outputs 1";

Json entry_json(const ManifestEntry& e) {
  return {{"subject", e.subject},
          {"expression", e.expression},
          {"group", e.group},
          {"age", e.age ? Json(*e.age) : Json()},
          {"other", e.other}};
}

// The files that gathering makes, as paths within OUT.
std::vector<std::string> gathered_files(const OutputTree& tree) {
  std::vector<fs::path> files = {tree.model(),     tree.model_card(".md"),   tree.model_card(".json"), tree.isomap(),
                                 tree.hierarchy(), tree.landmark_vertices(), tree.build_json()};
  for (const fs::path& folder : {tree.root / "levels", tree.exports(), tree.report()})
    if (fs::is_directory(folder))
      for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file()) files.push_back(entry.path());
  std::vector<std::string> names;
  for (const fs::path& file : files) names.push_back(file.lexically_relative(tree.root).generic_string());
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<std::string> hashes_of(const std::vector<std::string>& names, const OutputTree& tree, int jobs) {
  std::vector<std::string> hashes(names.size());
  parallel_for(static_cast<int>(names.size()), jobs, [&](int i) {
    const auto k = static_cast<size_t>(i);
    const fs::path file = tree.root / names[k];
    std::error_code error;
    if (fs::is_regular_file(file, error)) hashes[k] = sha256(read_file(file));
  });
  return hashes;
}

fs::path record_file(const OutputTree& tree) { return tree.root / "outputs.json"; }

}  // namespace

std::string effective_options(const BuildPipelineOptions& options) {
  Json j = Json::parse(describe_options(options));
  j["level_vertices"] = options.levels;
  j["mean_as_reference"] = options.mean_as_reference;
  j["criterion"] = criterion_name(options.criterion);
  j["symmetric"] = options.symmetric;
  j["variance_share"] = options.variance_share;
  j["scaling"] = options.scaling == Scaling::free ? "similarity" : "rigid";
  j["gain_balance"] = to_string(options.gain_balance);
  j["prune_quantile"] = options.prune_quantile;
  j["exclude"] = options.exclude;
  j["terms"] = options.terms;
  return json_text(j);
}

std::string gather_key(const BuildPipelineOptions& options, const BuildPipelineSummary& summary,
                       const std::map<std::string, ManifestEntry>& entries, const OutputTree& tree) {
  const GatherPlan plan = plan_gathering(summary.registered, options.levels.back(), options.memory);
  Json j = {{"version", FACEWRIGHT_VERSION},
            {"options", effective_options(options)},
            {"seed", options.seed},
            {"manifest", options.has_manifest()},
            {"at_hand", plan.on_disk ? plan.at_hand : 0},
            {"hierarchy", sha256(read_file(tree.hierarchy()))}};
  for (const ScanOutcome& o : summary.scans) {
    Json& scan = j["scans"][o.id];
    const auto entry = entries.find(o.id);
    if (entry != entries.end()) scan["entry"] = entry_json(entry->second);
    if (o.registered) {
      const Json report = Json::parse(read_file(tree.scan_report(o.id)));
      scan["key"] = report.at("key");
      scan["registered"] = report.at("registered_sha256");
    } else {
      scan["reason"] = o.reason;
    }
  }
  return sha256(json_text(j));
}

bool build_stands(const std::string& key, const OutputTree& tree, int jobs, BuildPipelineSummary* summary) {
  if (!fs::exists(record_file(tree))) return false;
  try {
    const Json j = Json::parse(read_file(record_file(tree)));
    if (j.at("format") != kFormat || j.at("key") != key) return false;
    std::vector<std::string> names, hashes;
    for (const auto& [name, hash] : j.at("files").items()) names.push_back(name), hashes.push_back(hash);
    if (names != gathered_files(tree) || hashes != hashes_of(names, tree, jobs)) return false;
    const Json& s = j.at("summary");
    summary->shape_modes = s.at("shape_modes");
    summary->colour_modes = s.at("colour_modes");
    summary->expression_modes = s.at("expression_modes");
    summary->blendshapes = s.at("blendshapes").get<std::vector<std::string>>();
    summary->pruned = s.at("pruned").get<std::map<std::string, std::string>>();
    summary->without_neutral = s.at("without_neutral").get<std::vector<std::string>>();
    summary->level_vertices = s.at("level_vertices").get<std::vector<int>>();
  } catch (const Json::exception&) {  // damaged: as if there were none
    return false;
  }
  summary->nothing_changed = true;
  return true;
}

void write_build_record(const std::string& key, const BuildPipelineSummary& s, const OutputTree& tree, int jobs) {
  const std::vector<std::string> names = gathered_files(tree), hashes = hashes_of(names, tree, jobs);
  Json j = {{"format", kFormat}, {"key", key}};
  j["summary"] = {{"shape_modes", s.shape_modes},
                  {"colour_modes", s.colour_modes},
                  {"expression_modes", s.expression_modes},
                  {"blendshapes", s.blendshapes},
                  {"pruned", s.pruned},
                  {"without_neutral", s.without_neutral},
                  {"level_vertices", s.level_vertices}};
  for (size_t i = 0; i < names.size(); ++i) j["files"][names[i]] = hashes[i];
  write_file(record_file(tree), json_text(j, 1) + "\n");
}

}  // namespace facewright
