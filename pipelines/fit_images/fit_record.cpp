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

bool focal_estimated(const PerspectiveFitResult& fit) { return fit.summary.options.camera.focal_px <= 0; }

std::string focal_source(const PerspectiveFitResult& fit) {
  if (!focal_estimated(fit)) return "given";
  return fit.summary.focal_determined ? "estimated" : "prior";
}

std::string to_string(CameraKind kind) { return kind == CameraKind::affine ? "affine" : "orthographic"; }

Json residuals(const FitNumbers& fit) {
  Json table = Json::object();
  for (const LandmarkResidual& r : fit.residuals)
    table[r.name] = {{"vertex", r.vertex},
                     {"measured", numbers(r.measured)},
                     {"fitted", numbers(r.fitted)},
                     {"error_px", (r.measured - r.fitted).norm()},
                     {"used", r.used}};
  return table;
}

Json camera_json(const FitResult& fit) {
  return {{"kind", to_string(fit.summary.options.camera)},
          {"convention", "pixel = A x + b, x in mm, centre of the top-left pixel is (0, 0), y down"},
          {"A", {numbers(fit.camera.A.row(0)), numbers(fit.camera.A.row(1))}},
          {"b", numbers(fit.camera.b)},
          {"pixels_per_mm", fit.orthographic.s}};
}

Json camera_json(const PerspectiveFitResult& fit) {
  const PerspectiveCamera& c = fit.camera;
  const PerspectiveFitSummary& s = fit.summary;
  Json json = {{"kind", "perspective"},
               {"convention",
                "q = R x + t, x in mm, q in camera axes (+x right, +y up, +z to the viewer); pixel = principal + focal "
                "(q.x, -q.y) / -q.z; centre of the top-left pixel is (0, 0), y down"},
               {"R", {numbers(c.R.row(0)), numbers(c.R.row(1)), numbers(c.R.row(2))}},
               {"t", numbers(c.t)},
               {"focal_px", c.focal_px},
               {"principal_px", numbers(c.principal)},
               {"focal_length", !focal_estimated(fit) ? "given"
                                : s.focal_determined  ? "estimated from the landmarks"
                                                      : "estimated, but hardly more than its prior"}};
  if (focal_estimated(fit)) {
    json["focal_log_stddev"] = s.focal_spread;
    json["focal_prior_px"] = s.options.camera.prior_focal_px;
  }
  json["distance_mm"] = s.distance_mm;
  json["pixels_per_mm"] = c.focal_px / std::max(s.distance_mm, 1e-9);
  return json;
}

Json texture_json(const TextureSummary& texture) {
  return {{"visible_share", static_cast<double>(texture.visible_texels) / std::max(texture.mapped_texels, 1)},
          {"mean_alpha", texture.mean_alpha}};
}

Json completion_json(const CompletionSummary& completion) {
  return {{"seen", completion.seen}, {"mirrored", completion.mirrored}, {"modelled", completion.modelled}};
}

std::string dump(const Json& json) { return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n"; }

// Shortest text that reads back as the same number.
std::string text(double x) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, x).ptr};
}

}  // namespace

FitNumbers fit_numbers(const FittedImage& image) {
  const auto common = [](FitNumbers& n, const auto& fit) {
    n.pose = fit.pose;
    n.shape_coefficients = fit.shape_coefficients;
    n.expression_coefficients = fit.expression_coefficients;
    n.blendshape_weights = fit.blendshape_weights;
    const auto& s = fit.summary;
    n.stop = s.stop, n.iterations = s.iterations, n.last_change = s.last_change;
    n.rms_px = s.rms_px, n.rms_percent = s.rms_percent, n.outer_eye_distance_px = s.outer_eye_distance_px;
    n.sigma_px = s.sigma_px, n.residuals = s.residuals, n.unknown = s.unknown;
  };
  FitNumbers n;
  if (image.perspective) {
    const PerspectiveFitResult& fit = *image.perspective;
    common(n, fit);
    n.shape_stddevs = fit.coefficient_spread.head(fit.shape_coefficients.size());
    n.lambda = fit.summary.options.fit.lambda;
    n.pixels_per_mm = fit.camera.focal_px / std::max(fit.summary.distance_mm, 1e-9);
  } else {
    common(n, image.fit);
    n.shape_stddevs = image.fit.shape_stddevs();
    n.lambda = image.fit.summary.options.lambda;
    n.pixels_per_mm = image.fit.orthographic.s;
  }
  return n;
}

std::string fit_json(const FittedImage& image, const FittedFace& face) {
  const FitNumbers fit = fit_numbers(image);
  Json json;
  json["image"] = image.image.filename().string();
  json["landmarks"] = image.landmarks.empty() ? "found in the image" : image.landmarks.filename().string();
  json["stop"] = to_string(fit.stop);
  json["iterations"] = fit.iterations;
  json["last_change"] = fit.last_change;
  json["pose"] = {{"order", "R = Ry(yaw) Rx(pitch) Rz(roll), head to camera axes (+x right, +y up, +z to the viewer)"},
                  {"yaw_deg", fit.pose.yaw * kDegrees},
                  {"pitch_deg", fit.pose.pitch * kDegrees},
                  {"roll_deg", fit.pose.roll * kDegrees}};
  json["camera"] = image.perspective ? camera_json(*image.perspective) : camera_json(image.fit);
  json["shape_coefficients"] = numbers(fit.shape_coefficients);
  json["shape_stddevs"] = numbers(fit.shape_stddevs);
  json["expression_coefficients"] = numbers(fit.expression_coefficients);
  json["blendshape_weights"] = fit.blendshape_weights;
  json["landmark_rms_px"] = fit.rms_px;
  json["landmark_rms_percent_of_outer_eye_distance"] = fit.rms_percent;
  json["outer_eye_distance_px"] = fit.outer_eye_distance_px;
  json["sigma_px"] = fit.sigma_px;
  json["lambda"] = fit.lambda;
  json["unknown_landmarks"] = fit.unknown;
  json["residuals"] = residuals(fit);
  json["texture"] = texture_json(face.texture.summary);
  if (!face.completed.texture.empty()) json["texture"].update(completion_json(face.completed.summary));
  return dump(json);
}

std::string person_json(const FitPersonSummary& person, const FittedFace& face) {
  const MultiFitSummary& s = person.fit.summary;
  Json json;
  json["stop"] = to_string(s.stop);
  json["iterations"] = s.iterations;
  json["last_change"] = s.last_change;
  json["used_images"] = person.images.fitted;
  json["shape_coefficients"] = numbers(person.fit.shape_coefficients);
  json["shape_stddevs"] = numbers(person.fit.shape_covariance.diagonal().cwiseSqrt());
  json["images"] = Json::array();
  size_t k = 0;
  for (const FittedImage& image : person.images.images) {
    Json entry = {{"image", image.image.filename().string()}, {"fitted", image.fitted}};
    if (!image.fitted) {
      entry["reason"] = image.reason;
    } else {
      entry["landmark_rms_px"] = image.fit.summary.rms_px;
      entry["landmark_rms_percent_of_outer_eye_distance"] = image.fit.summary.rms_percent;
      entry["yaw_deg"] = image.fit.pose.yaw * kDegrees;
      if (k < person.merge.shares.size()) {
        entry["texture_share"] = person.merge.shares[k];
        entry["texture_gain"] = numbers(person.merge.gains[k]);
      }
      ++k;
    }
    json["images"].push_back(entry);
  }
  if (!face.completed.texture.empty()) {
    json["texture"] = completion_json(face.completed.summary);
    json["texture"]["outlying_share"] = person.merge.outlying;
  }
  return dump(json);
}

std::string fits_csv(const std::vector<FittedImage>& fits) {
  Eigen::Index shape = 0, expression = 0;
  std::set<std::string> blendshapes;
  std::vector<FitNumbers> all;
  for (const FittedImage& f : fits) {
    all.push_back(f.fitted ? fit_numbers(f) : FitNumbers());
    shape = std::max(shape, all.back().shape_coefficients.size());
    expression = std::max(expression, all.back().expression_coefficients.size());
    for (const auto& [name, weight] : all.back().blendshape_weights) blendshapes.insert(name);
  }
  std::vector<std::string> header = {"image",    "landmarks",    "fitted",          "reason",
                                     "yaw_deg",  "pitch_deg",    "roll_deg",        "pixels_per_mm",
                                     "stop",     "iterations",   "landmark_rms_px", "landmark_rms_percent",
                                     "focal_px", "focal_source", "distance_mm"};
  const size_t fixed = header.size();
  for (Eigen::Index k = 1; k <= shape; ++k) header.push_back("shape_" + std::to_string(k));
  for (Eigen::Index k = 1; k <= expression; ++k) header.push_back("expression_" + std::to_string(k));
  for (const std::string& name : blendshapes) header.push_back("blendshape " + name);
  std::string csv = csv_line(header);
  for (size_t i = 0; i < fits.size(); ++i) {
    const FittedImage& f = fits[i];
    const FitNumbers& n = all[i];
    std::vector<std::string> line = {f.image.filename().string(), f.landmarks.filename().string(),
                                     f.fitted ? "yes" : "no", f.reason};
    if (f.fitted) {
      for (const double angle : {n.pose.yaw, n.pose.pitch, n.pose.roll}) line.push_back(text(angle * kDegrees));
      line.insert(line.end(), {text(n.pixels_per_mm), to_string(n.stop), std::to_string(n.iterations), text(n.rms_px),
                               text(n.rms_percent)});
      if (f.perspective)
        line.insert(line.end(), {text(f.perspective->camera.focal_px), focal_source(*f.perspective),
                                 text(f.perspective->summary.distance_mm)});
      line.resize(fixed);
      for (const double c : n.shape_coefficients) line.push_back(text(c));
      line.resize(fixed + static_cast<size_t>(shape));
      for (const double c : n.expression_coefficients) line.push_back(text(c));
      line.resize(fixed + static_cast<size_t>(shape + expression));
      for (const std::string& name : blendshapes) {
        const auto weight = n.blendshape_weights.find(name);
        line.push_back(weight == n.blendshape_weights.end() ? "" : text(weight->second));
      }
    }
    line.resize(header.size());
    csv += csv_line(line);
  }
  return csv;
}

}  // namespace facewright
