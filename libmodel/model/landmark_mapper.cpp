// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/landmark_mapper.h"

#include <charconv>
#include <fstream>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

std::string stripped(const std::string& s) {
  const auto first = s.find_first_not_of(" \t\r\"'"), last = s.find_last_not_of(" \t\r\"'");
  return first == std::string::npos ? "" : s.substr(first, last - first + 1);
}

LandmarkMapper::Target parse_target(const std::string& text) {
  const bool quoted = text.find('"') != std::string::npos || text.find('\'') != std::string::npos;
  const std::string value = stripped(text);
  int vertex = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), vertex);
  if (!quoted && error == std::errc{} && end == value.data() + value.size()) return vertex;
  return value;
}

}  // namespace

std::optional<int> LandmarkMapper::vertex(const std::string& name, const LandmarkSet& model_landmarks) const {
  std::string wanted = name;
  if (!identity_) {
    const auto entry = table_.find(name);
    if (entry == table_.end()) return std::nullopt;
    if (const int* index = std::get_if<int>(&entry->second)) return *index;
    wanted = std::get<std::string>(entry->second);
  }
  const auto mark = model_landmarks.find(wanted);
  if (mark == model_landmarks.end() || mark->second.vertex < 0) return std::nullopt;
  return mark->second.vertex;
}

LandmarkMapper read_landmark_mapping(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw IoError(path.string(), "cannot be opened; expected an eos landmark mapping");
  std::map<std::string, LandmarkMapper::Target> table;
  bool inside = false;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    line = line.substr(0, line.find('#'));
    const std::string text = stripped(line);
    if (text.empty()) continue;
    if (text.front() == '[' && line.find('=') == std::string::npos) {
      inside = text == "[landmark_mappings]";
    } else if (inside) {
      const auto equals = line.find('=');
      const std::string value = equals == std::string::npos ? "" : line.substr(equals + 1);
      if (stripped(value).empty()) throw IoError(path.string(), number, "expected 'name = vertex', got '" + text + "'");
      table[stripped(line.substr(0, equals))] = parse_target(value);
    }
  }
  if (table.empty()) throw IoError(path.string(), "has no entries under [landmark_mappings]");
  return LandmarkMapper(std::move(table));
}

}  // namespace facewright
