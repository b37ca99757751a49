// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/fit_images/scan_record.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;

Json numbers(const Eigen::VectorXd& x) { return std::vector<double>(x.data(), x.data() + x.size()); }

Json pose_json(const Similarity& pose) {
  return {{"convention", "x_scan = s R x_model + t, mm"},
          {"s", pose.s},
          {"R", {numbers(pose.R.row(0)), numbers(pose.R.row(1)), numbers(pose.R.row(2))}},
          {"t", numbers(pose.t)}};
}

template <typename Fit>
void put_coefficients(Json& json, const Fit& fit) {
  const Eigen::Index M = fit.shape_coefficients.size();
  json["stop"] = to_string(fit.summary.stop);
  json["scan_from_model"] = pose_json(fit.scan_from_model);
  json["shape_coefficients"] = numbers(fit.shape_coefficients);
  json["shape_stddevs"] = numbers(fit.coefficient_stddevs.head(M));
  json["expression_coefficients"] = numbers(fit.expression_coefficients);
  json["expression_stddevs"] = numbers(fit.coefficient_stddevs.tail(fit.coefficient_stddevs.size() - M));
}

double rms_of_matches(const Eigen::VectorXd& distances, const std::vector<ScanMatch>& matches) {
  double sum = 0;
  int count = 0;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (matches[i] != ScanMatch::counts) continue;
    sum += std::pow(distances[static_cast<Eigen::Index>(i)], 2);
    ++count;
  }
  return std::sqrt(sum / std::max(count, 1));
}

Json surface_json(const FitScanResult& fit) {
  const FitScanSummary& s = fit.summary;
  Json json = {{"vertices", s.vertices},          {"matched", s.matched},
               {"nothing_near", s.beyond},        {"at_a_border", s.at_rim},
               {"turned_away", s.turned},         {"trimmed", s.trimmed},
               {"median_mm", s.median_mm},        {"rms_mm", rms_of_matches(fit.distances, fit.matches)},
               {"scan_spacing_mm", s.spacing_mm}, {"sigma_mm", s.options.sigma_mm},
               {"lambda", s.options.lambda},      {"levels", Json::array()}};
  for (const ScanLevelSummary& level : s.levels)
    json["levels"].push_back({{"vertices", level.vertices},
                              {"stop", to_string(level.stop)},
                              {"iterations", level.iterations},
                              {"last_change", level.last_change}});
  return json;
}

Json refined_json(const RefinedFace& refined) {
  const RefineSummary& s = refined.summary;
  return {{"note", "free offsets after the fit: no face of the model, its coefficients are those of the fit"},
          {"stop", to_string(s.stop)},
          {"iterations", s.iterations},
          {"last_change_mm", s.last_change_mm},
          {"matched", s.matched},
          {"median_mm", s.median_mm},
          {"rms_mm", rms_of_matches(refined.distances, refined.matches)},
          {"mean_offset_mm", s.mean_offset},
          {"smoothing_mm", s.options.smoothing_mm}};
}

}  // namespace

ScanRecord scan_record(const FitScanFilesOptions& options, const MorphableModel& model, const LandmarkMapper& mapper,
                       const Landmarks& landmarks, const FitScanFilesSummary& summary) {
  Json json;
  json["scan"] = options.scan.filename().string();
  json["landmarks"] = summary.landmarks.filename().string();
  json["mm_per_unit"] = summary.mm_per_unit;
  json["unit"] = summary.units_reason;
  if (summary.scan) put_coefficients(json, *summary.scan);
  if (summary.points) put_coefficients(json, *summary.points);
  Vertices V;
  if (summary.scan) V = summary.scan->fitted;
  if (summary.points)
    V = summary.points->scan_from_model.apply(
        model.instance(summary.points->shape_coefficients, {}, -1, summary.points->expression_coefficients).V);
  Json residuals = Json::object();
  std::vector<std::string> unknown;
  double sum = 0;
  for (const auto& [name, mark] : landmarks) {
    const std::optional<int> vertex = mapper.vertex(name, model.landmarks());
    if (!vertex || !mark.position.allFinite()) {
      unknown.push_back(name);
      continue;
    }
    const Eigen::Vector3d fitted = V.row(*vertex).transpose();
    const double error = (mark.position - fitted).norm();
    residuals[name] = {
        {"vertex", *vertex}, {"measured", numbers(mark.position)}, {"fitted", numbers(fitted)}, {"error_mm", error}};
    sum += error * error;
  }
  ScanRecord record;
  record.landmark_rms_mm = std::sqrt(sum / static_cast<double>(std::max<size_t>(residuals.size(), 1)));
  json["landmark_rms_mm"] = record.landmark_rms_mm;
  json["unknown_landmarks"] = unknown;
  json["landmark_residuals"] = residuals;
  if (summary.scan) json["surface"] = surface_json(*summary.scan);
  if (summary.refined) json["refined"] = refined_json(*summary.refined);
  record.json = json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
  return record;
}

}  // namespace facewright
