// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/build_pipeline.h"

#include <algorithm>
#include <atomic>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/core/stage_clock.h"
#include "libmodel/interop/export_model.h"
#include "libmodel/interop/level_files.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/io/sha256.h"
#include "libmodel/model/model_file.h"
#include "libregister/reference/reference_face.h"
#include "pipelines/build_record.h"
#include "pipelines/build_report.h"
#include "pipelines/json_text.h"
#include "pipelines/matrix_hash.h"
#include "pipelines/model_stage.h"
#include "pipelines/output_tree.h"
#include "pipelines/reference_file.h"
#include "pipelines/scan_stage.h"
#include "pipelines/stored_model.h"
#include "pipelines/texture_stage.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

ReferenceFace load_reference(const BuildPipelineOptions& options) {
  ReferenceFace face =
      options.reference.empty() ? default_reference_face()
      : options.reference_landmarks.empty()
          ? load_reference_file(options.reference)
          : make_reference_face(read_mesh(options.reference), read_landmarks(options.reference_landmarks));
  if (!options.symmetric) face.mirror.clear();
  return face;
}

std::string reference_key(const LevelDecision& decision) {
  const MultiresTemplate& reference = decision.reference;
  std::string key =
      sha256_of(reference.V) + sha256_of(decision.appearance.mean) + sha256_of(decision.appearance.deviation);
  for (const TemplateLevel& l : reference.levels) key += sha256_of(l.F);
  for (const auto& [name, mark] : reference.landmarks) key += name + ":" + std::to_string(mark.vertex) + ";";
  return key;
}

void write_landmark_vertices(const MultiresTemplate& reference, const OutputTree& tree) {
  Json map;
  for (const auto& [name, mark] : reference.landmarks)
    if (mark.vertex >= 0) map[name] = mark.vertex;
  write_file_if_changed(tree.landmark_vertices(), json_text(map) + "\n");
}

// Registers all scans; results do not depend on the order in which threads take them.
std::vector<ScanOutcome> register_all(const std::vector<ScanFiles>& files,
                                      const std::map<std::string, std::string>& without_landmarks,
                                      const LevelDecision& decision, const BuildPipelineOptions& options,
                                      const OutputTree& tree, const Progress& progress) {
  std::vector<ScanOutcome> outcomes(files.size());
  std::atomic<int> done{0};
  const std::string key = reference_key(decision);
  const AppearanceGuide guide(decision.reference, decision.appearance);
  const int total = static_cast<int>(files.size());
  if (progress) progress({"registering", 0, total, ""});
  parallel_for(total, options.jobs, [&](int i) {
    const auto s = static_cast<size_t>(i);
    const auto without = without_landmarks.find(files[s].id);
    outcomes[s] = without == without_landmarks.end()
                      ? process_scan(files[s], decision.reference, guide, key, options, tree)
                      : left_out(files[s], "landmarks: " + without->second, tree);
    const int n = ++done;
    if (progress)
      progress({"registering", n, total,
                outcomes[s].id + (outcomes[s].registered ? "" : " left out: " + outcomes[s].reason)});
  });
  return outcomes;
}

constexpr const char* kScanFolders[] = {"registered", "scans", "pictures", "problematic", "landmarks"};

// OUT/scans/ID.json would overwrite the landmarks of scans that lie in OUT/scans.
void check_output(const std::vector<ScanFiles>& files, const OutputTree& tree) {
  std::set<fs::path> folders;
  for (const ScanFiles& f : files) folders.insert(fs::weakly_canonical(f.mesh).parent_path());
  for (const char* folder : kScanFolders)
    if (folders.count(fs::weakly_canonical(tree.root / folder)))
      throw InvalidInput("output: the scans lie in " + (tree.root / folder).string() +
                         ", where the build writes files of its own; choose another -o, for instance " +
                         (tree.root / "model").string());
  if (fs::exists(tree.root) && !fs::is_directory(tree.root))
    throw InvalidInput("output: " + tree.root.string() + " is a file; -o names a folder");
}

// Registrations of scans that are no longer in the folder must not linger beside the new ones. Only files
// of the kinds a build writes are removed, and only where one has been.
void remove_strangers(const std::vector<ScanFiles>& files, const OutputTree& tree) {
  if (!fs::exists(tree.build_json())) return;
  std::map<std::string, bool> known;
  for (const ScanFiles& f : files) known[f.id] = true;
  const std::map<std::string, std::vector<std::string>> ours = {{"registered", {".ply"}},
                                                                {"scans", {".json", ".origins", ".colour", ".png"}},
                                                                {"pictures", {".jpg"}},
                                                                {"problematic", {".txt"}}};
  for (const auto& [folder, extensions] : ours) {
    if (!fs::is_directory(tree.root / folder)) continue;
    std::vector<fs::path> strangers;
    for (const auto& entry : fs::directory_iterator(tree.root / folder)) {
      const fs::path& p = entry.path();
      const bool written_by_us =
          std::find(extensions.begin(), extensions.end(), p.extension().string()) != extensions.end();
      if (written_by_us && !known.count(p.stem().string())) strangers.push_back(p);
    }
    for (const fs::path& p : strangers) fs::remove(p);
  }
}

Json input_hashes(const std::vector<ScanFiles>& files) {
  Json inputs;
  for (const ScanFiles& f : files) {
    Json entry;
    entry["file"] = f.mesh.filename().string();
    std::error_code error;
    if (fs::file_size(f.mesh, error) > 0 && !error) entry["sha256"] = sha256(read_file(f.mesh));
    if (f.landmarks) entry["landmarks"] = f.landmarks->filename().string();
    inputs[f.id] = entry;
  }
  return inputs;
}

void write_build_json(const BuildPipelineOptions& options, const std::vector<ScanFiles>& files,
                      const BuildPipelineSummary& s, const OutputTree& tree) {
  Json j;
  j["program"] = "build-model";
  j["version"] = FACEWRIGHT_VERSION;
  j["options"] = Json::parse(effective_options(options));
  j["levels"] = {{"criterion", criterion_name(s.levels.criterion)},
                 {"mean_as_reference", s.levels.mean_as_reference},
                 {"scans", s.levels.scans},
                 {"left_out", s.levels.left_out}};
  j["seed"] = options.seed;
  j["inputs"] = input_hashes(files);
  j["landmarks"] = {{"given", s.landmarks.given},
                    {"completed", s.landmarks.completed},
                    {"found", s.landmarks.found},
                    {"by_hand", s.landmarks.by_hand}};
  j["registered"] = s.registered;
  j["problematic"] = Json::object();
  for (const ScanOutcome& o : s.scans)
    if (!o.registered) j["problematic"][o.id] = o.reason;
  j["pruned"] = s.pruned;
  j["without_neutral"] = s.without_neutral;
  j["blendshapes"] = s.blendshapes;
  j["expression_modes"] = s.expression_modes;
  j["shape_modes"] = s.shape_modes;
  j["colour_modes"] = s.colour_modes;
  for (const auto& [stage, seconds] : s.seconds) j["seconds"][stage] = seconds;
  write_file(tree.build_json(), json_text(j, 1) + "\n");
}

// What is known about the scans, by id; without a manifest only their names.
std::map<std::string, ManifestEntry> entries_of(const BuildPipelineOptions& options, std::vector<ScanFiles>* files) {
  std::map<std::string, ManifestEntry> entries;
  if (options.has_manifest()) {
    const Manifest manifest = read_manifest(options.scans);
    *files = find_scans(manifest);
    for (const ManifestEntry& e : manifest.entries) entries[e.id] = e;
  } else {
    *files = find_scans(options.scans);
    for (const ScanFiles& f : *files) entries[f.id].id = entries[f.id].subject = f.id;
  }
  for (const std::string& id : options.exclude)
    if (entries.erase(id) == 0)
      throw InvalidInput("exclude: there is no scan '" + id + "' in " + options.scans.string());
  std::erase_if(*files, [&](const ScanFiles& f) { return entries.count(f.id) == 0; });
  return entries;
}

// The scans that may decide what a face at rest looks like.
std::vector<ScanFiles> neutral_scans(std::vector<ScanFiles> files,
                                     const std::map<std::string, ManifestEntry>& entries) {
  std::erase_if(files, [&](const ScanFiles& f) { return !entries.at(f.id).neutral(); });
  if (files.empty()) throw InvalidInput("build: no scan has a neutral expression");
  return files;
}

std::vector<ManifestEntry> registered_entries(const BuildPipelineSummary& summary,
                                              const std::map<std::string, ManifestEntry>& entries) {
  std::vector<ManifestEntry> registered;
  for (const ScanOutcome& o : summary.scans)
    if (o.registered) registered.push_back(entries.at(o.id));
  return registered;
}

std::map<std::string, std::string> failures(const BuildPipelineSummary& summary) {
  std::map<std::string, std::string> reasons;
  for (const ScanOutcome& o : summary.scans)
    if (!o.registered) reasons[o.id] = o.reason;
  return reasons;
}

void describe_model(const ModelStageResult& stage, BuildPipelineSummary* summary) {
  const MorphableModel& model = stage.built.model;
  summary->shape_modes = static_cast<int>(model.shape().mode_count());
  summary->colour_modes = static_cast<int>(model.colour().mode_count());
  summary->expression_modes = model.expression() ? static_cast<int>(model.expression()->mode_count()) : 0;
  for (const Blendshape& b : model.blendshapes()) summary->blendshapes.push_back(b.name);
  summary->pruned = stage.pruned;
  summary->without_neutral = stage.expressions.without_neutral;
}

// Of the scans, those of this part.
std::vector<ScanFiles> part_of(const std::vector<ScanFiles>& files, const BuildPart& part) {
  std::vector<ScanFiles> mine;
  for (size_t i = 0; i < files.size(); ++i)
    if (part.holds(i)) mine.push_back(files[i]);
  return mine;
}

void check_part(const BuildPipelineOptions& options) {
  const BuildPart& part = options.part;
  if (part.count == 0) return;
  if (part.count < 0 || part.number < 1 || part.number > part.count)
    throw InvalidInput("build: expected a part of 1..n of n, got " + std::to_string(part.number) + " of " +
                       std::to_string(part.count));
  if (options.until == BuildStage::levels || options.until == BuildStage::model)
    throw InvalidInput(
        "build: landmarks and registration are done in parts, levels and the model from all scans at once");
}

std::uintmax_t largest_file(const std::vector<ScanFiles>& files) {
  std::uintmax_t most = 0;
  for (const ScanFiles& f : files) {
    std::error_code error;
    const std::uintmax_t size = fs::file_size(f.mesh, error);
    if (!error) most = std::max(most, size);
  }
  return most;
}

// Fewer jobs if need be; what cannot be done at all is said before any work.
void keep_within_memory(const std::vector<ScanFiles>& files, BuildPipelineOptions* options) {
  options->jobs = jobs_within(options->memory, largest_file(files), options->jobs);
  if (options->until == BuildStage::model && !options->levels.empty())
    plan_gathering(static_cast<int>(files.size()), options->levels.back(), options->memory);
}

void write_model_files(const MorphableModel& model, const OutputTree& tree, BuildPipelineSummary* summary,
                       const Progress& progress) {
  if (progress) progress({"writing the model", 0, 1 + model.level_count(), ""});
  save_model(tree.model(), model);
  for (int l = 0; l < model.level_count(); ++l) {
    const int vertices = model.levels()[static_cast<size_t>(l)].vertex_count;
    export_level_files(model, l, tree.level(vertices));
    summary->level_vertices.push_back(vertices);
    if (progress) progress({"writing the model", 2 + l, 1 + model.level_count(), ""});
  }
  export_all(tree.exports(), model);
}

// Registered scans to the model, its files and its report.
void gather(const BuildPipelineOptions& options, const std::map<std::string, ManifestEntry>& entries,
            const MultiresTemplate& reference, const OutputTree& tree, const Progress& progress,
            BuildPipelineSummary* summary, StageClock* clock) {
  if (progress) progress({"building the model", 0, 1, ""});
  const ModelStageResult stage =
      model_stage(registered_entries(*summary, entries), failures(*summary), reference, options, tree);
  describe_model(stage, summary);
  write_file(tree.model_card(".md"), stage.card_markdown);
  write_file(tree.model_card(".json"), stage.card_json);
  if (progress) progress({"building the model", 1, 1, ""});
  clock->finish("model");
  const TextureStage map =
      texture_stage(reference, as_vertices(stage.built.model.shape().mean), tree.isomap(), {.threads = options.jobs});
  const MorphableModel model = stage.built.model.with_uv(map.texture.uv);
  clock->finish("texture map");
  write_model_files(model, tree, summary, progress);
  clock->finish("files");
  if (progress) progress({"writing the report", 0, 1, ""});
  write_build_report(model, stage, *summary, options, tree);
  if (progress) progress({"writing the report", 1, 1, ""});
  clock->finish("report");
}

}  // namespace

BuildPipelineSummary build_from_scans(const BuildPipelineOptions& asked, const Progress& progress) {
  BuildPipelineOptions options = asked;
  if (options.until != BuildStage::model || options.part.count > 0) options.resume = true;
  BuildPipelineSummary summary;
  StageClock clock(&summary.seconds);
  const OutputTree tree{options.output};
  check_part(options);
  std::vector<ScanFiles> files;
  const std::map<std::string, ManifestEntry> entries = entries_of(options, &files);
  check_output(files, tree);
  keep_within_memory(files, &options);
  const ReferenceFace face = load_reference(options);
  fs::create_directories(tree.root);
  remove_strangers(files, tree);
  if (options.part.count == 0) remove_abandoned_temporaries(tree.root);  // other parts may run on other machines
  files = part_of(files, options.part);
  if (options.find_landmarks) summary.landmarks = landmark_stage(&files, face, options, tree, progress);
  clock.finish("landmarks");
  if (options.until == BuildStage::landmarks) return summary;
  const LevelDecision decision = decide_levels(face, neutral_scans(files, entries), options, tree, progress);
  const MultiresTemplate& reference = decision.reference;
  summary.levels = decision.summary;
  write_landmark_vertices(reference, tree);
  clock.finish("levels");
  if (options.until == BuildStage::levels) return summary;
  summary.scans = register_all(files, summary.landmarks.failed, decision, options, tree, progress);
  for (const ScanOutcome& o : summary.scans) ++(o.registered ? summary.registered : summary.failed);
  clock.finish("registration");
  if (options.until == BuildStage::registration) return summary;
  if (summary.registered < options.least_scans) {
    write_build_json(options, files, summary, tree);
    throw InvalidInput("build: " + std::to_string(summary.registered) + " of " + std::to_string(files.size()) +
                       " scans could be registered, at least " + std::to_string(options.least_scans) +
                       " are needed for a model; the reasons are in " + (tree.root / "problematic").string());
  }
  const std::string key = gather_key(options, summary, entries, tree);
  if (options.resume && build_stands(key, tree, options.jobs, &summary)) return summary;
  gather(options, entries, reference, tree, progress, &summary, &clock);
  write_build_json(options, files, summary, tree);
  write_build_record(key, summary, tree, options.jobs);
  return summary;
}

}  // namespace facewright
