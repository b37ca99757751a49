// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/core/landmarks.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <tuple>

namespace facewright {
namespace {

bool is_number(const std::string& s) {
  return !s.empty() && s.size() < 10 &&
         std::all_of(s.begin(), s.end(), [](unsigned char c) { return std::isdigit(c); });
}

// Mirror partner of each ibug-68 index (1-based); midline points map to themselves.
// Sagonas et al. 2013 mark-up: jaw 1-17, brows 18-27, nose 28-36, eyes 37-48, outer lips 49-60, inner lips 61-68.
constexpr std::array<int, 69> kIbugMirror = {0,  17, 16, 15, 14, 13, 12, 11, 10, 9,  8,  7,  6,  5,  4,  3,  2,  1,
                                             27, 26, 25, 24, 23, 22, 21, 20, 19, 18, 28, 29, 30, 31, 36, 35, 34, 33,
                                             32, 46, 45, 44, 43, 48, 47, 40, 39, 38, 37, 42, 41, 55, 54, 53, 52, 51,
                                             50, 49, 60, 59, 58, 57, 56, 65, 64, 63, 62, 61, 68, 67, 66};

std::string swap_word(const std::string& name, const std::string& from, const std::string& to) {
  std::string result = name;
  result.replace(name.find(from), from.size(), to);
  return result;
}

}  // namespace

bool LandmarkNameOrder::operator()(const std::string& a, const std::string& b) const {
  const bool na = is_number(a), nb = is_number(b);
  if (na != nb) return na;
  if (!na) return a < b;
  return std::make_tuple(std::stoi(a), a) < std::make_tuple(std::stoi(b), b);
}

Landmarks locate(const LandmarkSet& marks, const Vertices& V, const Faces& F) {
  Landmarks result;
  for (const auto& [name, mark] : marks)
    result[name].position = mark.vertex >= 0 ? Eigen::Vector3d(V.row(mark.vertex)) : position(mark.point, V, F);
  return result;
}

std::string mirrored_landmark(const std::string& name) {
  if (is_number(name)) {
    const int i = std::stoi(name);
    return i >= 1 && i <= 68 ? std::to_string(kIbugMirror[static_cast<size_t>(i)]) : name;
  }
  if (name.find("left") != std::string::npos) return swap_word(name, "left", "right");
  if (name.find("right") != std::string::npos) return swap_word(name, "right", "left");
  return name;
}

std::vector<std::string> common_names(const Landmarks& a, const Landmarks& b) {
  std::vector<std::string> names;
  for (const auto& entry : a)
    if (b.count(entry.first)) names.push_back(entry.first);
  return names;
}

}  // namespace facewright
