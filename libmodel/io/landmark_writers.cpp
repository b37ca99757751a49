// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Landmarks as other programs want them. The ways back are in landmark_json.cpp, landmark_text.cpp,
// landmark_tables.cpp.
#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/io/csv.h"
#include "libmodel/io/landmark_formats.h"
#include "libmodel/io/markup.h"
#include "libmodel/io/text_builder.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;

std::string row(const std::vector<double>& x, const char* between) {
  std::string out;
  for (size_t i = 0; i < x.size(); ++i) {
    if (i > 0) out += between;
    append_number(out, x[i]);
  }
  return out;
}

void require_solid(const RawLandmarks& landmarks, const char* format) {
  for (const RawLandmark& mark : landmarks)
    if (mark.x.size() != 3) throw InvalidInput(std::string(format) + " holds landmarks in 3D only");
}

[[noreturn]] void refuse_name(const char* format, const std::string& name, const char* expected) {
  throw InvalidInput(std::string(format) + " cannot hold the name '" + name + "': expected " + expected +
                     "; write .json instead");
}

// The name as a place from 1 on, 0: it is none.
int place_of(const std::string& name) {
  if (name.empty() || name.size() > 4 || name[0] == '0' ||
      !std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; }))
    return 0;
  return std::atoi(name.c_str());
}

}  // namespace

std::string to_picked_points(const RawLandmarks& landmarks) {
  require_solid(landmarks, "pp");
  std::string out = "<!DOCTYPE PickedPoints>\n<PickedPoints>\n";
  const char* const axes[] = {"x", "y", "z"};
  for (const RawLandmark& mark : landmarks) {
    out += " <point";
    for (size_t k = 0; k < 3; ++k) {
      out += std::string(" ") + axes[k] + "=\"";
      append_number(out, mark.x[k]);
      out += '"';
    }
    out += " active=\"1\" name=\"" + markup_text(mark.name) + "\"/>\n";
  }
  return out + "</PickedPoints>\n";
}

std::string to_markups(const RawLandmarks& landmarks) {
  require_solid(landmarks, "mrk.json");
  Json points = Json::array();
  for (const RawLandmark& mark : landmarks)
    points.push_back({{"id", std::to_string(points.size() + 1)},
                      {"label", mark.name},
                      {"position", mark.x},
                      {"selected", true},
                      {"visibility", true},
                      {"positionStatus", "defined"}});
  const Json root = {
      {"@schema",
       "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/"
       "Schema/markups-schema-v1.0.3.json#"},
      {"markups",
       {{{"type", "Fiducial"}, {"coordinateSystem", "LPS"}, {"coordinateUnits", "mm"}, {"controlPoints", points}}}}};
  return root.dump(1) + "\n";
}

std::string to_fcsv(const RawLandmarks& landmarks) {
  require_solid(landmarks, "fcsv");
  std::string out =
      "# Markups fiducial file version = 5.0\n# CoordinateSystem = LPS\n"
      "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n";
  for (size_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i].name.find_first_of("\r\n") != std::string::npos)
      refuse_name("fcsv", landmarks[i].name, "a single line");
    out += std::to_string(i + 1) + "," + row(landmarks[i].x, ",") + ",0,0,0,1,1,1,0," + csv_field(landmarks[i].name) +
           ",,\n";
  }
  return out;
}

std::string to_ljson(const RawLandmarks& landmarks) {
  Json points = Json::array(), labels = Json::array();
  const bool numbered =
      std::all_of(landmarks.begin(), landmarks.end(), [](const RawLandmark& mark) { return place_of(mark.name) > 0; });
  for (size_t i = 0; i < landmarks.size(); ++i) {
    const RawLandmark& mark = landmarks[i];
    if (numbered) {
      if (static_cast<int>(points.size()) >= place_of(mark.name))
        refuse_name("ljson", mark.name, "numbers in ascending order");
      while (static_cast<int>(points.size()) + 1 < place_of(mark.name))
        points.push_back(Json::array_t(mark.x.size(), Json()));
    } else {
      labels.push_back({{"label", mark.name}, {"mask", {i}}});
    }
    points.push_back(mark.x);
  }
  if (numbered) {
    std::vector<int> mask;
    for (const RawLandmark& mark : landmarks) mask.push_back(place_of(mark.name) - 1);
    labels.push_back({{"label", "all"}, {"mask", mask}});
  }
  const Json root = {{"groups", {{"LJSON", {{"labels", labels}, {"landmarks", {{"points", points}}}}}}},
                     {"version", 3}};
  return root.dump(1) + "\n";
}

std::string to_landmark_csv(const RawLandmarks& landmarks) {
  const bool solid = landmarks.empty() || landmarks[0].x.size() == 3;
  const bool with_deviation =
      std::any_of(landmarks.begin(), landmarks.end(), [](const RawLandmark& mark) { return mark.stddev > 0; });
  std::string out = solid ? "name,x,y,z" : "name,x,y";
  out += with_deviation ? ",stddev\n" : "\n";
  for (const RawLandmark& mark : landmarks) {
    out += csv_field(mark.name) + "," + row(mark.x, ",");
    if (with_deviation) out += ",";
    if (mark.stddev > 0) append_number(out, mark.stddev);
    out += "\n";
  }
  return out;
}

std::string to_tlms(const RawLandmarks& landmarks) {
  std::string out;
  for (const RawLandmark& mark : landmarks) {
    if (mark.name.find_first_of(" \t\r\n") != std::string::npos || mark.name.starts_with("#"))
      refuse_name("tlms", mark.name, "a word without blanks");
    out += mark.name + " 1 " + row(mark.x, " ") + "\n";
  }
  return out;
}

std::string to_bnd(const RawLandmarks& landmarks) {
  require_solid(landmarks, "bnd");
  std::string out;
  for (size_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i].name != "bnd_" + std::to_string(i + 1))
      refuse_name("bnd", landmarks[i].name, "'bnd_1', 'bnd_2', ... without gaps");
    out += "0\t" + row(landmarks[i].x, "\t") + "\n";
  }
  return out;
}

std::string to_lm3(const RawLandmarks& landmarks) {
  require_solid(landmarks, "lm3");
  std::string out = std::to_string(landmarks.size()) + " landmarks:\n";
  for (const RawLandmark& mark : landmarks) {
    if (mark.name.empty() || mark.name.find_first_of("\r\n") != std::string::npos || mark.name.starts_with("#") ||
        mark.name.front() == ' ' || mark.name.back() == ' ')
      refuse_name("lm3", mark.name, "a single line that does not start with '#'");
    out += mark.name + "\n" + row(mark.x, " ") + "\n";
  }
  return out;
}

}  // namespace facewright
