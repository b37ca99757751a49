// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/fit_images/fit_record.h"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "libmodel/io/csv.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kDegrees = 180 / std::numbers::pi;

Json numbers(const Eigen::VectorXd& x) { return std::vector<double>(x.data(), x.data() + x.size()); }

Json residuals(const FitSummary& summary) {
  Json table = Json::object();
  for (const LandmarkResidual& r : summary.residuals)
    table[r.name] = {{"vertex", r.vertex},
                     {"measured", numbers(r.measured)},
                     {"fitted", numbers(r.fitted)},
                     {"error_px", (r.measured - r.fitted).norm()},
                     {"used", r.used}};
  return table;
}

// Shortest text that reads back as the same number.
std::string text(double x) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, x).ptr};
}

}  // namespace

std::string fit_json(const FittedImage& image, const FitModelResult& result) {
  const TextureSummary& texture = result.texture.summary;
  const CompletionSummary& completion = result.completed.summary;
  const FitResult& fit = image.fit;
  const FitSummary& s = fit.summary;
  Json json;
  json["image"] = image.image.filename().string();
  json["landmarks"] = image.landmarks.empty() ? "found in the image" : image.landmarks.filename().string();
  json["stop"] = to_string(s.stop);
  json["iterations"] = s.iterations;
  json["last_change"] = s.last_change;
  json["pose"] = {{"order", "R = Ry(yaw) Rx(pitch) Rz(roll), head to camera axes (+x right, +y up, +z to the viewer)"},
                  {"yaw_deg", fit.pose.yaw * kDegrees},
                  {"pitch_deg", fit.pose.pitch * kDegrees},
                  {"roll_deg", fit.pose.roll * kDegrees}};
  json["camera"] = {{"convention", "pixel = A x + b, x in mm, centre of the top-left pixel is (0, 0), y down"},
                    {"A", {numbers(fit.camera.A.row(0)), numbers(fit.camera.A.row(1))}},
                    {"b", numbers(fit.camera.b)},
                    {"pixels_per_mm", fit.orthographic.s}};
  json["shape_coefficients"] = numbers(fit.shape_coefficients);
  json["shape_stddevs"] = numbers(fit.shape_stddevs());
  json["expression_coefficients"] = numbers(fit.expression_coefficients);
  json["blendshape_weights"] = fit.blendshape_weights;
  json["landmark_rms_px"] = s.rms_px;
  json["landmark_rms_percent_of_outer_eye_distance"] = s.rms_percent;
  json["outer_eye_distance_px"] = s.outer_eye_distance_px;
  json["sigma_px"] = s.sigma_px;
  json["lambda"] = s.options.lambda;
  json["unknown_landmarks"] = s.unknown;
  json["residuals"] = residuals(s);
  json["texture"] = {
      {"visible_share", static_cast<double>(texture.visible_texels) / std::max(texture.mapped_texels, 1)},
      {"mean_alpha", texture.mean_alpha},
      {"seen", completion.seen},
      {"mirrored", completion.mirrored},
      {"modelled", completion.modelled}};
  return json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string fits_csv(const std::vector<FittedImage>& fits) {
  Eigen::Index shape = 0, expression = 0;
  for (const FittedImage& f : fits) {
    shape = std::max(shape, f.fit.shape_coefficients.size());
    expression = std::max(expression, f.fit.expression_coefficients.size());
  }
  std::vector<std::string> header = {"image",   "landmarks",  "fitted",          "reason",
                                     "yaw_deg", "pitch_deg",  "roll_deg",        "pixels_per_mm",
                                     "stop",    "iterations", "landmark_rms_px", "landmark_rms_percent"};
  const size_t fixed = header.size();
  for (Eigen::Index k = 1; k <= shape; ++k) header.push_back("shape_" + std::to_string(k));
  for (Eigen::Index k = 1; k <= expression; ++k) header.push_back("expression_" + std::to_string(k));
  std::set<std::string> blendshapes;
  for (const FittedImage& f : fits)
    for (const auto& [name, weight] : f.fit.blendshape_weights) blendshapes.insert(name);
  for (const std::string& name : blendshapes) header.push_back("blendshape " + name);
  std::string csv = csv_line(header);
  for (const FittedImage& f : fits) {
    const FitSummary& s = f.fit.summary;
    std::vector<std::string> line = {f.image.filename().string(), f.landmarks.filename().string(),
                                     f.fitted ? "yes" : "no", f.reason};
    if (f.fitted) {
      for (const double angle : {f.fit.pose.yaw, f.fit.pose.pitch, f.fit.pose.roll})
        line.push_back(text(angle * kDegrees));
      line.insert(line.end(), {text(f.fit.orthographic.s), to_string(s.stop), std::to_string(s.iterations),
                               text(s.rms_px), text(s.rms_percent)});
      for (const double c : f.fit.shape_coefficients) line.push_back(text(c));
      line.resize(fixed + static_cast<size_t>(shape));
      for (const double c : f.fit.expression_coefficients) line.push_back(text(c));
      line.resize(fixed + static_cast<size_t>(shape + expression));
      for (const std::string& name : blendshapes) {
        const auto weight = f.fit.blendshape_weights.find(name);
        line.push_back(weight == f.fit.blendshape_weights.end() ? "" : text(weight->second));
      }
    }
    line.resize(header.size());
    csv += csv_line(line);
  }
  return csv;
}

}  // namespace facewright
