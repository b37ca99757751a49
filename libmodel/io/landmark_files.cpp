// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/landmark_files.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/landmark_formats.h"
#include "libmodel/io/text_encoding.h"

namespace facewright {
namespace {

constexpr const char* kExpected =
    "expected landmarks in .json, .pts, .pp, .mrk.json, .fcsv, .ljson, .tlms, .csv, .bnd or .lm3, got '";

std::string lower_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

RawLandmarks parse(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path), name = path.string(), text = read_file(path);
  if (extension == ".json") return parse_landmark_json(text, name);
  if (extension == ".ljson") return parse_ljson(text, name);
  if (extension == ".pts") return parse_pts(text, name);
  if (extension == ".pp") return parse_picked_points(text, name);
  if (extension == ".fcsv") return parse_fcsv(text, name);
  if (extension == ".csv") return parse_landmark_csv(text, name);
  if (extension == ".tlms") return parse_tlms(text, name);
  if (extension == ".bnd") return parse_bnd(text, name);
  if (extension == ".lm3") return parse_lm3(text, name);
  throw IoError(name, kExpected + extension + "'");
}

template <int D>
std::map<std::string, LandmarkPoint<D>, LandmarkNameOrder> named(const RawLandmarks& raw, const std::string& path) {
  std::map<std::string, LandmarkPoint<D>, LandmarkNameOrder> out;
  for (const RawLandmark& mark : raw) {
    if (mark.x.size() != D)
      throw IoError(path, "landmark '" + mark.name + "' has " + std::to_string(mark.x.size()) +
                              " coordinates, expected " + std::to_string(D));
    LandmarkPoint<D> point;
    for (int k = 0; k < D; ++k) point.position[k] = mark.x[static_cast<size_t>(k)];
    point.stddev = mark.stddev;
    if (!out.emplace(as_utf8(mark.name), point).second)
      throw IoError(path, "landmark '" + mark.name + "' occurs twice");
  }
  return out;
}

template <typename Map>
RawLandmarks raw(const Map& landmarks, double offset) {
  RawLandmarks out;
  for (const auto& [name, point] : landmarks) {
    if (!point.position.allFinite()) throw InvalidInput("landmark '" + name + "' to write is not finite");
    RawLandmark mark{name, {}, point.stddev};
    for (const double x : point.position) mark.x.push_back(x + offset);
    out.push_back(std::move(mark));
  }
  return out;
}

// The RawLandmarks must be in the convention of the format already.
std::string format(const std::filesystem::path& path, const RawLandmarks& marks) {
  const std::string extension = lower_extension(path);
  const bool markups = lower_extension(path.stem()) == ".mrk";
  if (extension == ".json") return markups ? to_markups(marks) : to_landmark_json(marks);
  if (extension == ".ljson") return to_ljson(marks);
  if (extension == ".pts") return to_pts(marks);
  if (extension == ".pp") return to_picked_points(marks);
  if (extension == ".fcsv") return to_fcsv(marks);
  if (extension == ".csv") return to_landmark_csv(marks);
  if (extension == ".tlms") return to_tlms(marks);
  if (extension == ".bnd") return to_bnd(marks);
  if (extension == ".lm3") return to_lm3(marks);
  throw IoError(path.string(), kExpected + extension + "'");
}

}  // namespace

Landmarks read_landmarks(const std::filesystem::path& path) { return named<3>(parse(path), path.string()); }

ImageLandmarks read_image_landmarks(const std::filesystem::path& path) {
  RawLandmarks marks = parse(path);
  const std::string extension = lower_extension(path);
  for (RawLandmark& mark : marks) {
    if (mark.x.size() != 2) continue;
    if (extension == ".pts")
      for (double& x : mark.x) x -= 1;  // ibug counts pixels from 1
    if (extension == ".ljson") std::swap(mark.x[0], mark.x[1]);
  }
  return named<2>(marks, path.string());
}

void write_landmarks(const std::filesystem::path& path, const Landmarks& landmarks) {
  write_file(path, format(path, raw(landmarks, 0)));
}

void write_image_landmarks(const std::filesystem::path& path, const ImageLandmarks& landmarks) {
  const std::string extension = lower_extension(path);
  RawLandmarks marks = raw(landmarks, extension == ".pts" ? 1 : 0);
  if (extension == ".ljson")
    for (RawLandmark& mark : marks) std::swap(mark.x[0], mark.x[1]);
  write_file(path, format(path, marks));
}

}  // namespace facewright
