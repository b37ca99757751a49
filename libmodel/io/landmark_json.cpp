// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/io/json_depth.h"
#include "libmodel/io/landmark_formats.h"
#include "libmodel/io/text_builder.h"

namespace facewright {
namespace {

using Json = nlohmann::json;

Json parse(std::string_view text, const std::string& path) {
  if (json_depth(text) > kMostJsonDepth) throw IoError(path, "nests its lists too deeply; it is damaged");
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& e) {
    const auto upto = text.substr(0, std::min(text.size(), e.byte));
    throw IoError(path, 1 + static_cast<int>(std::count(upto.begin(), upto.end(), '\n')), "not valid JSON");
  } catch (const Json::exception& e) {  // a number out of range
    throw IoError(path, std::string("not valid JSON: ") + e.what());
  }
}

[[noreturn]] void fail(const std::string& path, const std::string& name, const std::string& what) {
  throw IoError(path, "landmark '" + name + "': " + what);
}

std::vector<double> numbers(const Json& value, const std::string& path, const std::string& name) {
  if (!value.is_array() || value.size() < 2 || value.size() > 3) fail(path, name, "expected 2 or 3 coordinates");
  std::vector<double> x;
  for (const Json& v : value) {
    if (!v.is_number() || !std::isfinite(v.get<double>())) fail(path, name, "a coordinate is not a finite number");
    x.push_back(v.get<double>());
  }
  return x;
}

double standard_deviation(const Json& value, const std::string& path, const std::string& name) {
  if (!value.contains("stddev")) return 0;
  const Json& s = value["stddev"];
  if (!s.is_number() || !(s.get<double>() >= 0)) fail(path, name, "stddev must be a number >= 0");
  return s.get<double>();
}

RawLandmarks flat(const Json& root, const std::string& path) {
  RawLandmarks out;
  for (const auto& [name, value] : root.items()) {
    const bool detailed = value.is_object() && value.contains("position");
    if (!detailed && !value.is_array())
      fail(path, name, "expected [x, y, z] or {\"position\": [x, y, z], \"stddev\": s}");
    out.push_back({name, numbers(detailed ? value["position"] : value, path, name),
                   detailed ? standard_deviation(value, path, name) : 0});
  }
  return out;
}

RawLandmarks markups(const Json& root, const std::string& path) {
  RawLandmarks out;
  for (const Json& list : root["markups"]) {
    const bool ras =
        list.value("coordinateSystem", Json("LPS")) == "RAS" || list.value("coordinateSystem", Json()) == 0;
    for (const Json& point : list.value("controlPoints", Json::array())) {
      if (!point.is_object() || point.value("positionStatus", Json("defined")) != "defined") continue;
      const Json label = point.value("label", Json());
      if (!label.is_string()) throw IoError(path, "a control point has no label");
      RawLandmark mark{label.get<std::string>(), numbers(point.value("position", Json()), path, label), 0};
      if (ras) mark.x[0] = -mark.x[0], mark.x[1] = -mark.x[1];
      out.push_back(std::move(mark));
    }
  }
  return out;
}

// Names from labels of which each marks one point, if every point has one: {"label": l, "mask": [i]}, or a mask of
// true and false.
void name_by_labels(RawLandmarks& out, const Json& labels, size_t points) {
  if (!labels.is_array() || labels.size() != points) return;
  std::vector<std::string> names(points);
  for (const Json& label : labels) {
    const Json mask = label.value("mask", Json());
    if (!mask.is_array() || !label.value("label", Json()).is_string()) return;
    size_t at = points;
    if (mask.size() == 1 && mask[0].is_number_unsigned())
      at = mask[0].get<size_t>();
    else if (mask.size() == points && std::count(mask.begin(), mask.end(), Json(true)) == 1)
      at = static_cast<size_t>(std::find(mask.begin(), mask.end(), Json(true)) - mask.begin());
    if (at >= points || !names[at].empty()) return;
    names[at] = label["label"].get<std::string>();
  }
  for (RawLandmark& mark : out) mark.name = names[static_cast<size_t>(std::stoi(mark.name)) - 1];
}

void append_points(RawLandmarks& out, int& index, const Json& points, const std::string& path) {
  if (!points.is_array()) throw IoError(path, "expected 'points' to be a list");
  for (const Json& point : points) {
    const std::string name = std::to_string(++index);
    const bool missing = point.is_null() || (point.is_array() && !point.empty() && point[0].is_null());
    if (!missing) out.push_back({name, numbers(point, path, name), 0});
  }
}

}  // namespace

RawLandmarks parse_landmark_json(std::string_view text, const std::string& path) {
  const Json root = parse(text, path);
  if (!root.is_object()) throw IoError(path, "expected an object of landmarks, {\"31\": [x, y, z], ...}");
  if (!root.contains("markups")) return flat(root, path);
  try {
    return markups(root, path);
  } catch (const Json::exception&) {
    throw IoError(path, "Slicer markups: expected markups[].controlPoints[].{label, position}");
  }
}

RawLandmarks parse_ljson(std::string_view text, const std::string& path) {
  const Json root = parse(text, path);
  RawLandmarks out;
  int index = 0;
  try {
    if (root.is_object() && root.contains("groups")) {
      for (const auto& group : root["groups"])  // version 1: a list of {landmarks: [{point}]}; version 3: an object
        if (group.at("landmarks").is_array()) {
          Json points = Json::array();
          for (const Json& mark : group["landmarks"]) points.push_back(mark.at("point"));
          append_points(out, index, points, path);
        } else {
          append_points(out, index, group["landmarks"].at("points"), path);
        }
    } else {
      append_points(out, index, root.at("landmarks").at("points"), path);
    }
    const bool one_group = !root.contains("groups") || (root["groups"].is_object() && root["groups"].size() == 1);
    if (one_group && index > 1) {
      const Json& group = root.contains("groups") ? root["groups"].front() : root;
      name_by_labels(out, group.value("labels", Json()), static_cast<size_t>(index));
    }
  } catch (const Json::exception&) {
    throw IoError(path, "ljson: expected landmarks.points or groups.*.landmarks.points");
  }
  return out;
}

std::string to_landmark_json(const RawLandmarks& landmarks) {
  std::string out = "{";
  for (const RawLandmark& mark : landmarks) {
    std::string position = "[";
    for (size_t i = 0; i < mark.x.size(); ++i) {
      if (i > 0) position += ", ";
      append_number(position, mark.x[i]);
    }
    position += "]";
    out += (out.size() > 1 ? ",\n  " : "\n  ") + Json(mark.name).dump() + ": ";
    if (mark.stddev > 0) {
      out += "{\"position\": " + position + ", \"stddev\": ";
      append_number(out, mark.stddev);
      out += "}";
    } else {
      out += position;
    }
  }
  return out + "\n}\n";
}

}  // namespace facewright
