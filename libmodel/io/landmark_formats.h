// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: landmark files before they are told apart into 2D and 3D.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace facewright {

struct RawLandmark {
  std::string name;
  std::vector<double> x;  ///< as in the file, axes turned where the format says so
  double stddev = 0;
};
using RawLandmarks = std::vector<RawLandmark>;

RawLandmarks parse_landmark_json(std::string_view text, const std::string& path);  ///< flat or Slicer markups
RawLandmarks parse_ljson(std::string_view text, const std::string& path);
RawLandmarks parse_pts(std::string_view text, const std::string& path);
RawLandmarks parse_picked_points(std::string_view text, const std::string& path);
RawLandmarks parse_fcsv(std::string_view text, const std::string& path);
RawLandmarks parse_landmark_csv(std::string_view text, const std::string& path);
RawLandmarks parse_tlms(std::string_view text, const std::string& path);
RawLandmarks parse_bnd(std::string_view text, const std::string& path);
RawLandmarks parse_lm3(std::string_view text, const std::string& path);

std::string to_landmark_json(const RawLandmarks& landmarks);
std::string to_pts(const RawLandmarks& landmarks);
std::string to_picked_points(const RawLandmarks& landmarks);
std::string to_markups(const RawLandmarks& landmarks);
std::string to_fcsv(const RawLandmarks& landmarks);
std::string to_ljson(const RawLandmarks& landmarks);
std::string to_landmark_csv(const RawLandmarks& landmarks);
std::string to_tlms(const RawLandmarks& landmarks);
std::string to_bnd(const RawLandmarks& landmarks);
std::string to_lm3(const RawLandmarks& landmarks);

}  // namespace facewright
