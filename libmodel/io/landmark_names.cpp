// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/landmark_names.h"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <set>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/csv.h"
#include "libmodel/io/text_encoding.h"
#include "libmodel/io/text_scanner.h"

namespace facewright {
namespace {

struct NamePair {
  std::string theirs, ours;
  int line = 0;
};

std::vector<NamePair> from_json(const std::string& text, const std::string& path) {
  const auto root = nlohmann::ordered_json::parse(text, nullptr, false);
  if (!root.is_object()) throw IoError(path, "expected a JSON object, {\"Nose tip\": \"31\", ...}");
  std::vector<NamePair> pairs;
  for (const auto& [theirs, ours] : root.items()) {
    if (!ours.is_string()) throw IoError(path, "'" + theirs + "': expected the name as text, \"31\"");
    pairs.push_back({theirs, ours.get<std::string>()});
  }
  return pairs;
}

std::vector<NamePair> from_csv(const std::string& text, const std::string& path) {
  std::vector<NamePair> pairs;
  for (const CsvRow& row : parse_csv(text, path)) {
    if (row.fields.size() != 2) throw IoError(path, row.line, "expected two columns, theirs,ours");
    const bool header = pairs.empty() && (row.fields[0] == "theirs" || row.fields[0] == "from");
    if (!header) pairs.push_back({row.fields[0], row.fields[1], row.line});
  }
  return pairs;
}

std::string bare(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  if (text.size() >= 2 && (text.front() == '"' || text.front() == '\'') && text.back() == text.front())
    text = text.substr(1, text.size() - 2);
  return std::string(text);
}

std::vector<NamePair> from_lines(const std::string& text, const std::string& path) {
  std::vector<NamePair> pairs;
  TextScanner scan(text, path);
  for (scan.skip_space(); !scan.at_end(); scan.skip_space()) {
    const std::string line(scan.rest_of_line());
    if (line.starts_with("#") || line.starts_with("[")) continue;
    const size_t equals = line.find('=');
    if (equals == line.npos) scan.fail("expected \"theirs\" = \"ours\"");
    std::string right = line.substr(equals + 1);
    const size_t comment = right.find(" #");
    if (comment != right.npos) right.resize(comment);
    pairs.push_back({bare(std::string_view(line).substr(0, equals)), bare(right), scan.line()});
  }
  return pairs;
}

}  // namespace

LandmarkNames read_landmark_names(const std::filesystem::path& path) {
  const std::string text = as_utf8(read_file(path)), name = path.string();
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto pairs = extension == ".json"  ? from_json(text, name)
                     : extension == ".csv" ? from_csv(text, name)
                                           : from_lines(text, name);
  LandmarkNames names;
  std::set<std::string> ours;
  for (const NamePair& pair : pairs) {
    if (pair.theirs.empty() || pair.ours.empty()) throw IoError(name, pair.line, "a landmark name is empty");
    if (!names.emplace(pair.theirs, pair.ours).second || !ours.insert(pair.ours).second)
      throw IoError(name, pair.line, "'" + pair.theirs + "' or '" + pair.ours + "' occurs twice");
  }
  if (names.empty()) throw IoError(name, "no landmark names");
  return names;
}

Landmarks rename_landmarks(const Landmarks& landmarks, const LandmarkNames& names) {
  Landmarks renamed;
  for (const auto& [name, point] : landmarks)
    if (const auto known = names.find(name); known != names.end()) renamed.emplace(known->second, point);
  if (renamed.empty())
    throw InvalidInput("landmark names: the mapping knows none of the scan's landmarks" +
                       (landmarks.empty() ? std::string() : ", such as '" + landmarks.begin()->first + "'"));
  return renamed;
}

}  // namespace facewright
