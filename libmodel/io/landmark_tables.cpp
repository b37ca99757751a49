// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Landmark files with one point a line: .tlms, .csv, .bnd, .lm3.
#include <algorithm>
#include <cctype>
#include <optional>

#include "libmodel/core/errors.h"
#include "libmodel/io/csv.h"
#include "libmodel/io/landmark_formats.h"
#include "libmodel/io/text_scanner.h"

namespace facewright {
namespace {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// The text as a finite number, if it is one and nothing else.
std::optional<double> number_in(const std::string& text, const std::string& path) {
  TextScanner scan(text, path);
  try {
    const double value = scan.number();
    if (!scan.more_on_line()) return value;
  } catch (const IoError&) {
  }
  return {};
}

// Which field of a row is what; -1: not there.
struct Columns {
  int name = -1, x = -1, y = -1, z = -1, stddev = -1;
};

std::optional<Columns> columns_of_header(const CsvRow& row) {
  Columns columns;
  for (size_t i = 0; i < row.fields.size(); ++i) {
    const std::string field = lower(row.fields[i]);
    const int at = static_cast<int>(i);
    if (field == "name" || field == "label" || field == "id" || field == "landmark") columns.name = at;
    if (field == "x") columns.x = at;
    if (field == "y") columns.y = at;
    if (field == "z") columns.z = at;
    if (field == "stddev" || field == "sigma") columns.stddev = at;
  }
  if (columns.x < 0 || columns.y < 0) return {};
  return columns;
}

// Without a header: x,y,z are all numbers of three; else the name comes first.
Columns columns_of_first_row(const CsvRow& row, const std::string& path) {
  if (row.fields.size() == 4) return {0, 1, 2, 3, -1};
  if (row.fields.size() == 3) {
    if (number_in(row.fields[0], path)) return {-1, 0, 1, 2, -1};
    return {0, 1, 2, -1, -1};
  }
  throw IoError(path, row.line, "csv: expected columns name,x,y,z, with or without a header, or x,y,z");
}

double field_number(const CsvRow& row, int column, const std::string& path) {
  const std::string& text = row.fields[static_cast<size_t>(column)];
  if (const auto value = number_in(text, path)) return *value;
  throw IoError(path, row.line, "csv: expected a finite number, got '" + text.substr(0, 40) + "'");
}

}  // namespace

RawLandmarks parse_landmark_csv(std::string_view text, const std::string& path) {
  std::vector<CsvRow> rows = parse_csv(text, path);
  if (rows.empty()) throw IoError(path, "csv: no landmarks");
  std::optional<Columns> columns = columns_of_header(rows.front());
  const size_t length = rows.front().fields.size();
  if (columns)
    rows.erase(rows.begin());
  else
    columns = columns_of_first_row(rows.front(), path);
  RawLandmarks out;
  for (const CsvRow& row : rows) {
    if (row.fields.size() != length)
      throw IoError(
          path, row.line,
          "csv: " + std::to_string(row.fields.size()) + " fields, the first line has " + std::to_string(length));
    RawLandmark mark;
    mark.name = columns->name >= 0 ? row.fields[static_cast<size_t>(columns->name)] : std::to_string(out.size() + 1);
    if (mark.name.empty()) throw IoError(path, row.line, "csv: a landmark has no name");
    for (const int column : {columns->x, columns->y, columns->z})
      if (column >= 0) mark.x.push_back(field_number(row, column, path));
    if (columns->stddev >= 0 && !row.fields[static_cast<size_t>(columns->stddev)].empty())
      mark.stddev = field_number(row, columns->stddev, path);
    if (mark.stddev < 0) throw IoError(path, row.line, "csv: stddev must be >= 0");
    out.push_back(std::move(mark));
  }
  return out;
}

RawLandmarks parse_tlms(std::string_view text, const std::string& path) {
  TextScanner scan(text, path);
  RawLandmarks out;
  for (; !scan.at_end(); scan.next_line()) {
    if (!scan.more_on_line()) continue;
    RawLandmark mark;
    mark.name = std::string(scan.token());
    if (mark.name.starts_with("#")) continue;
    const double visible = scan.number();
    if (visible != 0 && visible != 1) scan.fail("tlms: expected 'name visible x y [z]' with visible 0 or 1");
    while (scan.more_on_line() && mark.x.size() < 4) mark.x.push_back(scan.number());
    if (mark.x.size() < 2 || mark.x.size() > 3) scan.fail("tlms: expected 2 or 3 coordinates");
    if (visible == 1) out.push_back(std::move(mark));
  }
  return out;
}

RawLandmarks parse_bnd(std::string_view text, const std::string& path) {
  TextScanner scan(text, path);
  RawLandmarks out;
  for (scan.skip_space(); !scan.at_end(); scan.skip_space()) {
    scan.number();  // a vertex of the mesh
    RawLandmark mark{"bnd_" + std::to_string(out.size() + 1), {}, 0};
    for (int k = 0; k < 3; ++k) mark.x.push_back(scan.number());
    if (scan.more_on_line()) scan.fail("bnd: expected 'vertex x y z'");
    out.push_back(std::move(mark));
  }
  if (out.empty()) throw IoError(path, "bnd: no landmarks");
  return out;
}

RawLandmarks parse_lm3(std::string_view text, const std::string& path) {
  TextScanner scan(text, path);
  const auto next_text = [&]() -> std::string {
    for (scan.skip_space(); !scan.at_end(); scan.skip_space()) {
      std::string line(scan.rest_of_line());
      if (!line.starts_with("#")) return line;
    }
    return {};
  };
  const std::string head = next_text();
  const std::string_view count_text = std::string_view(head).substr(0, head.find(' '));
  const auto promised = number_in(std::string(count_text), path);
  if (!promised || lower(head).find("landmarks") == head.npos) scan.fail("lm3: expected 'N landmarks:'");
  RawLandmarks out;
  for (std::string name = next_text(); !name.empty(); name = next_text()) {
    RawLandmark mark{name, {}, 0};
    scan.skip_space();
    for (int k = 0; k < 3; ++k) mark.x.push_back(scan.number());
    if (scan.more_on_line()) scan.fail("lm3: expected three numbers below '" + name + "'");
    out.push_back(std::move(mark));
  }
  if (static_cast<double>(out.size()) != *promised)
    scan.fail("lm3: the first line says " + std::string(count_text) + " landmarks, the file has " +
              std::to_string(out.size()));
  return out;
}

}  // namespace facewright
