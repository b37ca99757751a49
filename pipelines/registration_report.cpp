// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/registration_report.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "libmodel/building/colour_reliability.h"
#include "libmodel/building/colour_sampling.h"
#include "libmodel/core/errors.h"
#include "libmodel/geometry/normals.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/surface/nearest.h"
#include "pipelines/json_text.h"

namespace facewright {

using Json = nlohmann::ordered_json;

namespace {

// In the order of MatchStatus.
constexpr const char* kStatusNames[kMatchStatusCount] = {"accepted",       "too_far",    "normal_disagrees",
                                                         "on_scan_border", "unreliable", "not_mutual"};
constexpr const char* kStatusWords[kMatchStatusCount] = {
    "accepted",           "too far from the scan",
    "facing another way", "at the scan's border",
    "on mended parts",    "nearer to another part of the reference"};

Json failures_json(const RegisterSummary& s) {
  Json j = Json::object();
  for (size_t k = 1; k < kMatchStatusCount; ++k) j[kStatusNames[k]] = s.match_status[k];
  return j;
}

template <class Value>
Eigen::VectorXd read_letters(const std::filesystem::path& file, Eigen::Index vertices, const Value& value) {
  const std::string letters = read_file(file);
  if (static_cast<Eigen::Index>(letters.size()) != vertices)
    throw IoError(file.string(), "has " + std::to_string(letters.size()) + " characters, the mesh has " +
                                     std::to_string(vertices) + " vertices; build into an empty folder");
  Eigen::VectorXd values(vertices);
  for (Eigen::Index v = 0; v < vertices; ++v) values[v] = value(letters[static_cast<size_t>(v)]);
  return values;
}

// printf into a string.
std::string text(const char* format, ...) {
  char buffer[512];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  return buffer;
}

std::string join(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& w : words) all += (all.empty() ? "" : " ") + w;
  return all;
}

std::string landmark_line(const RegisterSummary& s) {
  std::string line =
      text("landmarks     %d used, %.2f mm off on average, %.2f mm at most; scan %.3f times the reference",
           s.landmarks_used, s.landmark_mean, s.landmark_max, s.scale);
  if (!s.landmarks_rejected.empty())
    line += text("\n              %d rejected, the others put them elsewhere: ",
                 static_cast<int>(s.landmarks_rejected.size())) +
            join(s.landmarks_rejected);
  if (s.swapped_left_right) line += "\n              left and right were swapped and have been put right";
  return line;
}

std::string match_line(const RegisterSummary& s) {
  const double share = 100.0 / std::max(1, s.matched + s.mirrored + s.interpolated + s.free);
  std::string line =
      text("vertices      matched %d (%.1f %%), mirrored %d (%.1f %%), interpolated %d (%.1f %%), free %d", s.matched,
           share * s.matched, s.mirrored, share * s.mirrored, s.interpolated, share * s.interpolated, s.free);
  std::string reasons;
  for (size_t k = 1; k < kMatchStatusCount; ++k)
    if (s.match_status[k] > 0)
      reasons += (reasons.empty() ? "" : ", ") + std::to_string(s.match_status[k]) + " " + kStatusWords[k];
  return reasons.empty() ? line : line + "\nno match      " + reasons;
}

}  // namespace

std::string describe_registration(const Scan& scan, const RegisterSummary& s) {
  const Json report = {
      {"id", scan.id},
      {"units", {{"mm_per_unit", scan.mm_per_unit}, {"reason", scan.units_reason}}},
      {"warnings", scan.warnings},
      {"repair",
       {{"degenerate", scan.repair.degenerate},
        {"duplicate", scan.repair.duplicate},
        {"non_manifold", scan.repair.non_manifold},
        {"island_triangles", scan.repair.island_triangles},
        {"unused_vertices", scan.repair.unused_vertices}}},
      {"scan", {{"vertices", scan.mesh.vertex_count()}, {"triangles", scan.mesh.face_count()}}},
      {"noise_mm", s.denoise.noise},
      {"spikes", s.denoise.spikes},
      {"landmarks",
       {{"used", s.landmarks_used},
        {"rejected", s.landmarks_rejected},
        {"swapped_left_right", s.swapped_left_right},
        {"residual_mean_mm", s.landmark_mean},
        {"residual_max_mm", s.landmark_max}}},
      {"global_mapping",
       {{"scale", s.scale},
        {"landmark_noise_mm", s.landmark_noise},
        {"guided", s.guided},
        {"leave_one_out_rms_mm", s.leave_one_out_rms}}},
      {"origins",
       {{"matched", s.matched}, {"mirrored", s.mirrored}, {"interpolated", s.interpolated}, {"free", s.free}}},
      {"match_failures", failures_json(s)},
      {"surface_mm", {{"mean", s.surface_mean}, {"p95", s.surface_p95}}},
      {"folded_edges", {{"count", s.folds}, {"percent", s.fold_percent}}},
      {"acceptable", s.acceptable},
      {"concern", s.concern},
      {"stage_seconds", Json(Json::object_t(s.seconds.begin(), s.seconds.end()))}};
  return json_text(report, 1);
}

std::string summarise_registration(const RegisterSummary& s) {
  std::string lines = text("denoising     noise %.3f mm, %d spikes put back, %d vertices moved", s.denoise.noise,
                           s.denoise.spikes, s.denoise.filtered);
  lines += "\n" + landmark_line(s) + "\n" + match_line(s);
  lines += text("\nsurface       mean %.3f mm, 95 %% within %.3f mm of the denoised scan (matched vertices)",
                s.surface_mean, s.surface_p95);
  lines += text("\nfolds         %d edges (%.4f %%)\nseconds      ", s.folds, s.fold_percent);
  for (const auto& [stage, seconds] : s.seconds) lines += text(" %s %.2f,", stage.c_str(), seconds);
  if (!s.seconds.empty()) lines.pop_back();
  return lines;
}

Mesh coloured_registration(const Scan& scan, const RegistrationResult& r, const Faces& F) {
  Mesh mesh;
  mesh.V = r.V;
  mesh.F = F;
  Mesh source = scan.mesh;
  source.V = r.denoised.V;
  mesh.colours = sample_colours(source, scan.texture, r.nearest, vertex_edge_lengths(r.V, F));
  return mesh;
}

Eigen::VectorXd colour_weights(const RegistrationResult& r, const Faces& F) {
  Eigen::VectorXd weights = colour_reliability(r.V, F, r.denoised, r.nearest);
  for (Eigen::Index v = 0; v < weights.size(); ++v)
    if (r.origins[static_cast<size_t>(v)] != MatchOrigin::matched) weights[v] = 0;
  return weights;
}

std::string weight_digits(const Eigen::VectorXd& weights) {
  std::string digits;
  for (const double w : weights) digits += static_cast<char>('0' + std::lround(9 * std::clamp(w, 0.0, 1.0)));
  return digits;
}

Eigen::VectorXd read_colour_weights(const std::filesystem::path& file, Eigen::Index vertices) {
  return read_letters(file, vertices, [](char c) { return std::clamp((c - '0') / 9.0, 0.0, 1.0); });
}

Eigen::VectorXd read_matched(const std::filesystem::path& file, Eigen::Index vertices) {
  return read_letters(file, vertices, [](char c) { return c == 'm' ? 1.0 : 0.0; });
}

std::string origin_letters(const std::vector<MatchOrigin>& origins) {
  constexpr char kLetters[] = {'f', 'm', 'r', 'i'};  // in the order of MatchOrigin
  std::string letters;
  for (const MatchOrigin o : origins) letters += kLetters[static_cast<int>(o)];
  return letters;
}

}  // namespace facewright
