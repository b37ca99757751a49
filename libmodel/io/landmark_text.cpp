// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>
#include <array>
#include <utility>

#include "libmodel/core/errors.h"
#include "libmodel/io/landmark_formats.h"
#include "libmodel/io/text_builder.h"
#include "libmodel/io/text_scanner.h"

namespace facewright {
namespace {

/// "n_points: 68" and "n_points:68".
void pts_header_line(TextScanner& scan, long long& promised) {
  std::string line(scan.rest_of_line());
  const size_t colon = line.find(':');
  if (colon == line.npos)
    scan.fail("pts: expected 'version: 1', 'n_points: N' or '{', got '" + line.substr(0, 40) + "'");
  if (line.substr(0, colon).find("n_points") == line.npos) return;
  TextScanner value(std::string_view(line).substr(colon + 1), "");
  if (!value.more_on_line()) scan.fail("pts: n_points without a number");
  try {
    promised = value.integer();
  } catch (const IoError&) {
    scan.fail("pts: n_points is not a number");
  }
}

/// Value of attribute `key` in an XML tag, entities decoded; found is false if it is missing.
std::pair<std::string, bool> attribute(std::string_view tag, const std::string& key) {
  for (size_t at = tag.find(key); at != tag.npos; at = tag.find(key, at + 1)) {
    size_t p = at + key.size();
    if (at == 0 || !(tag[at - 1] == ' ' || tag[at - 1] == '\t' || tag[at - 1] == '\n' || tag[at - 1] == '\r')) continue;
    while (p < tag.size() && tag[p] == ' ') ++p;
    if (p >= tag.size() || tag[p] != '=') continue;
    const size_t open = tag.find_first_of("\"'", p);
    const size_t close = open == tag.npos ? open : tag.find(tag[open], open + 1);
    if (close == tag.npos) return {{}, false};
    std::string value(tag.substr(open + 1, close - open - 1));
    for (const auto& [entity, character] : std::array<std::pair<std::string_view, char>, 5>{
             {{"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}, {"&amp;", '&'}}})
      for (size_t e = value.find(entity); e != value.npos; e = value.find(entity, e + 1))
        value.replace(e, entity.size(), 1, character);
    return {value, true};
  }
  return {{}, false};
}

// Fields of a line, quotes as in RFC 4180.
std::vector<std::string> split(std::string_view line, char separator) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"') {
      if (quoted && i + 1 < line.size() && line[i + 1] == '"')
        fields.back() += c, ++i;
      else
        quoted = !quoted;
    } else if (c == separator && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

double to_number(const std::string& text, const std::string& path, int line) {
  TextScanner scan(text, path);
  try {
    const double value = scan.number();
    if (!scan.more_on_line()) return value;
  } catch (const IoError&) {
  }
  throw IoError(path, line, "expected a finite number, got '" + text.substr(0, 40) + "'");
}

int line_of(std::string_view text, size_t offset) {
  return 1 + static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(offset), '\n'));
}

}  // namespace

RawLandmarks parse_pts(std::string_view text, const std::string& path) {
  TextScanner scan(text, path);
  long long promised = -1;
  for (scan.skip_space(); !scan.accept('{'); scan.next_line(), scan.skip_space()) {
    if (scan.at_end()) scan.fail("pts: no '{' before the points");
    pts_header_line(scan, promised);
  }
  RawLandmarks out;
  for (scan.skip_space(); !scan.accept('}'); scan.skip_space()) {
    if (scan.at_end()) scan.fail("pts: no '}' after the points");
    RawLandmark mark{std::to_string(out.size() + 1), {}, 0};
    while (scan.more_on_line() && mark.x.size() < 4) mark.x.push_back(scan.number());
    if (mark.x.size() < 2 || mark.x.size() > 3) scan.fail("pts: expected 2 or 3 numbers");
    if (!out.empty() && out[0].x.size() != mark.x.size()) scan.fail("pts: 2D and 3D points mixed");
    out.push_back(std::move(mark));
  }
  if (promised >= 0 && promised != static_cast<long long>(out.size()))
    scan.fail("pts: n_points says " + std::to_string(promised) + ", the file has " + std::to_string(out.size()));
  return out;
}

RawLandmarks parse_picked_points(std::string_view text, const std::string& path) {
  if (text.find("<PickedPoints") == text.npos) throw IoError(path, 1, "pp: expected an element <PickedPoints>");
  RawLandmarks out;
  for (size_t at = text.find("<point"); at != text.npos; at = text.find("<point", at + 1)) {
    const size_t close = text.find('>', at);
    const int line = line_of(text, at);
    if (close == text.npos) throw IoError(path, line, "pp: unfinished <point>");
    const std::string_view tag = text.substr(at, close - at);
    if (attribute(tag, "active") == std::pair<std::string, bool>("0", true)) continue;
    RawLandmark mark;
    const auto [name, named] = attribute(tag, "name");
    if (!named || name.empty()) throw IoError(path, line, "pp: a point has no name");
    mark.name = name;
    for (const char* key : {"x", "y", "z"}) {
      const auto [value, found] = attribute(tag, key);
      if (!found) throw IoError(path, line, "pp: point '" + name + "' has no " + key);
      mark.x.push_back(to_number(value, path, line));
    }
    out.push_back(std::move(mark));
  }
  return out;
}

RawLandmarks parse_fcsv(std::string_view text, const std::string& path) {
  // Columns by position: id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID.
  constexpr size_t label_column = 11;
  TextScanner scan(text, path);
  bool ras = true;
  RawLandmarks out;
  for (; !scan.at_end(); scan.next_line()) {
    const std::string line(scan.rest_of_line());
    if (line.empty()) continue;
    if (line[0] == '#') {
      const size_t at = line.find("CoordinateSystem");
      if (at != line.npos) {
        const std::string value = line.substr(line.find('=') == line.npos ? line.size() : line.find('=') + 1);
        ras = value.find("LPS") == value.npos && value.find('1') == value.npos;
      }
      continue;
    }
    const std::vector<std::string> fields = split(line, ',');
    if (fields.size() <= label_column || fields[label_column].empty())
      scan.fail("fcsv: expected id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,...");
    RawLandmark mark{fields[label_column], {}, 0};
    for (size_t i = 1; i <= 3; ++i) mark.x.push_back(to_number(fields[i], path, scan.line()));
    if (ras) mark.x[0] = -mark.x[0], mark.x[1] = -mark.x[1];
    out.push_back(std::move(mark));
  }
  return out;
}

std::string to_pts(const RawLandmarks& landmarks) {
  std::string out = "version: 1\nn_points: " + std::to_string(landmarks.size()) + "\n{\n";
  for (size_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i].name != std::to_string(i + 1))
      throw InvalidInput("pts cannot name its points: expected '1'..'" + std::to_string(landmarks.size()) +
                         "' without gaps, got '" + landmarks[i].name + "' at place " + std::to_string(i + 1) +
                         "; write .json instead");
    for (size_t k = 0; k < landmarks[i].x.size(); ++k) {
      if (k > 0) out += ' ';
      append_number(out, landmarks[i].x[k]);
    }
    out += '\n';
  }
  return out + "}\n";
}

}  // namespace facewright
