// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/landmark_mapper.h"

#include <charconv>
#include <fstream>
#include <sstream>

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

/// The names in `[a, "b", ...]`, brackets included or not.
void add_names(const std::string& text, std::vector<std::string>& names) {
  std::stringstream items(text);
  for (std::string item; std::getline(items, item, ',');) {
    std::erase_if(item, [](char c) { return c == '[' || c == ']'; });
    if (const std::string name = stripped(item); !name.empty()) names.push_back(name);
  }
}

/// Reads a mapping line by line.
class MappingReader {
 public:
  explicit MappingReader(const std::filesystem::path& path) : path_(path.string()) {}

  void read(const std::string& whole_line) {
    ++number_;
    const std::string line = whole_line.substr(0, whole_line.find('#')), text = stripped(line);
    if (text.empty()) return;
    if (open_list_) {
      continue_list(line);
    } else if (text.front() == '[' && line.find('=') == std::string::npos) {
      section_ = text;
    } else if (section_.empty() || section_ == "[landmark_mappings]") {
      const auto [key, value] = split(line, text);
      table_[key] = parse_target(value);
    } else if (section_ == "[contour_landmarks]") {
      const auto [key, value] = split(line, text);
      if (key != "right" && key != "left")
        throw IoError(path_, number_, "expected 'right = [...]' or 'left = [...]', got '" + text + "'");
      open_list_ = key == "right" ? &contour_.right : &contour_.left;
      continue_list(value);
    }
  }

  LandmarkMapper finished() {
    if (open_list_) throw IoError(path_, number_, "a list of landmarks is not closed; expected ']'");
    if (table_.empty()) throw IoError(path_, "has no entries 'name = vertex' (alone or under [landmark_mappings])");
    return LandmarkMapper(std::move(table_), std::move(contour_));
  }

 private:
  std::pair<std::string, std::string> split(const std::string& line, const std::string& text) const {
    const auto equals = line.find('=');
    const std::string value = equals == std::string::npos ? "" : line.substr(equals + 1);
    if (stripped(value).empty()) throw IoError(path_, number_, "expected 'name = vertex', got '" + text + "'");
    return {stripped(line.substr(0, equals)), value};
  }

  void continue_list(const std::string& text) {
    add_names(text, *open_list_);
    if (text.find(']') != std::string::npos) open_list_ = nullptr;
  }

  std::string path_, section_;
  int number_ = 0;
  std::map<std::string, LandmarkMapper::Target> table_;
  ContourLandmarks contour_;
  std::vector<std::string>* open_list_ = nullptr;
};

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
  if (!file) throw IoError(path.string(), "cannot be opened; expected a landmark mapping");
  MappingReader reader(path);
  for (std::string line; std::getline(file, line);) reader.read(line);
  return reader.finished();
}

}  // namespace facewright
