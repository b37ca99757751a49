// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/scan_stage.h"

#include <chrono>
#include <nlohmann/json.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/io/sha256.h"
#include "libregister/intake/mesh_import.h"
#include "pipelines/error_picture.h"
#include "pipelines/json_text.h"
#include "pipelines/registration_report.h"
#include "pipelines/scan_colours.h"
#include "pipelines/scan_picture.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

Json schedule_json(const std::vector<LevelSchedule>& levels) {
  Json list = Json::array();
  for (const LevelSchedule& s : levels)
    list.push_back({{"iterations", s.iterations},
                    {"smoothing_mm", {s.smoothing_first, s.smoothing_last}},
                    {"welsch_mm", {s.welsch_first, s.welsch_last}},
                    {"highest_distance_mm", s.highest_distance},
                    {"highest_angle_deg", s.highest_angle_deg},
                    {"landmark_weight", s.landmark_weight},
                    {"move_rest", s.move_rest}});
  return list;
}

Json options_json(const BuildPipelineOptions& o) {
  const RegisterOptions& r = o.registration;
  return {{"units", static_cast<int>(o.scan.units)},
          {"least_island", o.scan.repair.least_island},
          {"denoise",
           {{"method", static_cast<int>(r.denoise.method)},
            {"noise_gate_mm", r.denoise.noise_gate},
            {"gaussian_width", r.denoise.gaussian_width},
            {"passes", r.denoise.passes},
            {"spike_deviation", r.denoise.spike_deviation},
            {"spike_isolation", r.denoise.spike_isolation},
            {"spike_roughness", r.denoise.spike_roughness},
            {"largest_cluster", r.denoise.largest_cluster},
            {"highest_flagged", r.denoise.highest_flagged},
            {"widest", {r.denoise.widest, r.denoise.widest_mm}},
            {"agreement", {r.denoise.agreement, r.denoise.misfit}},
            {"bilateral", {r.denoise.bilateral_sigma, r.denoise.normal_passes, r.denoise.vertex_passes}}}},
          {"align",
           {{"inlier_distance_mm", r.align.inlier_distance},
            {"scale", {r.align.lowest_scale, r.align.highest_scale}},
            {"least_inliers", r.align.least_inliers}}},
          {"global",
           {{"outlier_distance_mm", r.global.outlier_distance},
            {"outlier_factor", r.global.outlier_factor},
            {"highest_dropped", r.global.highest_dropped},
            {"slide", r.global.slide},
            {"least_for_spline", r.global.least_for_spline},
            {"least_for_smoothness", r.global.least_for_smoothness},
            {"smoothness",
             {r.global.smoothness.amplitude, r.global.smoothness.amplitude_spread, r.global.smoothness.noise_spread}}}},
          {"levels", schedule_json(r.levels)},
          {"landmark_stddev_mm", r.landmark_stddev},
          {"guide_rounds", r.guide_rounds},
          {"use_mirror", r.use_mirror},
          {"match_vertices", r.match_vertices}};
}

std::string scan_key(const ScanFiles& files, const std::string& reference_key, const BuildPipelineOptions& options) {
  std::string material = reference_key + json_text(options_json(options)) + sha256(read_file(files.mesh));
  if (const auto texture = texture_file(files.mesh)) material += sha256(read_file(*texture));  // it guides
  if (files.landmarks) material += sha256(read_file(*files.landmarks));
  if (files.landmarks && options.scan.landmark_names) material += sha256(read_file(*options.scan.landmark_names));
  if (files.units != Units::automatic) material += "units " + std::to_string(static_cast<int>(files.units));
  return sha256(material);
}

bool is_done(const std::string& id, const std::string& key, const OutputTree& tree) {
  if (!fs::exists(tree.scan_report(id)) || !fs::exists(tree.registered(id)) || !fs::exists(tree.scan_origins(id)) ||
      !fs::exists(tree.error_picture(id)) || !fs::exists(tree.colour_weights(id)) || !fs::exists(tree.scan_picture(id)))
    return false;
  const Json report = Json::parse(read_file(tree.scan_report(id)), nullptr, false);
  return !report.is_discarded() && report.value("key", "") == key &&
         report.value("registered_sha256", "") == sha256(read_file(tree.registered(id)));
}

void write_outputs(const Scan& scan, const RegistrationResult& r, const MultiresTemplate& reference,
                   const std::string& key, double started, const OutputTree& tree) {
  write_ply(tree.registered(scan.id), coloured_registration(scan, r, reference.levels.back().F));
  write_png(tree.error_picture(scan.id), error_picture(r, reference));
  write_jpeg(tree.scan_picture(scan.id), scan_picture(scan, r, reference), 85);
  write_file(tree.scan_origins(scan.id), origin_letters(r.origins));
  write_file(tree.colour_weights(scan.id), weight_digits(colour_weights(r, reference.levels.back().F)));
  Json report = Json::parse(describe_registration(scan, r.summary));
  const auto now = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  report["seconds"] = now - started;
  report["key"] = key;
  report["registered_sha256"] = sha256(read_file(tree.registered(scan.id)));
  write_file(tree.scan_report(scan.id), json_text(report, 1) + "\n");  // last: its presence says that the rest is whole
}

void write_problem(const std::string& id, const ScanFiles& files, const std::string& reason, const OutputTree& tree) {
  std::error_code ignored;
  for (const auto& stale : {tree.scan_report(id), tree.registered(id), tree.scan_origins(id), tree.error_picture(id),
                            tree.colour_weights(id), tree.scan_picture(id)})
    fs::remove(stale, ignored);
  write_file_if_changed(tree.problem(id), "scan: " + files.mesh.string() + "\n" + reason + "\n");
}

constexpr const char* kNoLandmarks =
    "landmarks: there are none beside the scan. Put a file ID.json, .pts, .pp, .mrk.json, .fcsv or .ljson with at "
    "least "
    "3 (better 12 or more) ibug landmarks there, or let them be found.";

}  // namespace

std::string describe_options(const BuildPipelineOptions& options) { return json_text(options_json(options)); }

ScanOutcome process_scan(const ScanFiles& files, const MultiresTemplate& reference, const AppearanceGuide& guide,
                         const std::string& reference_key, const BuildPipelineOptions& options,
                         const OutputTree& tree) {
  ScanOutcome outcome;
  outcome.id = files.id;
  const double started = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  std::string stage = "intake";
  try {
    const std::string key = scan_key(files, reference_key, options);
    if (options.resume && is_done(files.id, key, tree)) {
      outcome.registered = outcome.kept = true;
      return outcome;
    }
    if (!files.landmarks) throw InvalidInput(kNoLandmarks);
    const Scan scan = load_scan(files, options.scan);
    stage = "registration";
    const RegistrationResult result =
        register_scan(mesh_with_colours(scan), scan.landmarks, reference, options.registration, &guide);
    outcome.summary = result.summary;
    if (!result.summary.acceptable)
      throw InvalidInput("the registration is not trusted: " + result.summary.concern +
                         "check that the scan shows a whole face and that its landmarks are right");
    stage = "writing";
    write_outputs(scan, result, reference, key, started, tree);
    std::error_code ignored;
    fs::remove(tree.problem(files.id), ignored);
    outcome.registered = true;
  } catch (const std::exception& e) {
    if (stage == "writing") throw;  // a full disk is not the scan's fault
    outcome.reason = stage + ": " + e.what();
    write_problem(files.id, files, outcome.reason, tree);
  }
  outcome.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count() - started;
  return outcome;
}

ScanOutcome left_out(const ScanFiles& files, const std::string& reason, const OutputTree& tree) {
  ScanOutcome outcome;
  outcome.id = files.id;
  outcome.reason = reason;
  write_problem(files.id, files, reason, tree);
  return outcome;
}

RegisteredSet read_registered_set(const std::vector<std::string>& ids, const MultiresTemplate& reference,
                                  const OutputTree& tree) {
  RegisteredSet set;
  set.ids = ids;
  const Eigen::Index S = static_cast<Eigen::Index>(ids.size()), N = reference.V.rows();
  set.shapes.resize(S, 3 * N);
  set.visibility = set.colour_weights = SampleMatrix::Zero(S, N);
  for (Eigen::Index s = 0; s < S; ++s) {
    const std::string& id = ids[static_cast<size_t>(s)];
    const Mesh mesh = read_mesh(tree.registered(id));
    if (mesh.V.rows() != N)
      throw InvalidInput(tree.registered(id).string() + ": " + std::to_string(mesh.V.rows()) +
                         " vertices, the reference has " + std::to_string(N) + "; build into an empty folder");
    set.shapes.row(s) = Eigen::Map<const Eigen::RowVectorXd>(mesh.V.data(), 3 * N);
    set.visibility.row(s) = read_matched(tree.scan_origins(id), N).transpose();
    if (!mesh.has_colours()) continue;
    if (set.colours.size() == 0) set.colours = SampleMatrix::Zero(S, 3 * N);
    set.colours.row(s) = Eigen::Map<const Eigen::RowVectorXd>(mesh.colours.data(), 3 * N);
    set.colour_weights.row(s) = read_colour_weights(tree.colour_weights(id), N).transpose();
  }
  return set;
}

}  // namespace facewright
