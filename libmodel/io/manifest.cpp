// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/manifest.h"

#include <algorithm>
#include <charconv>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/csv.h"
#include "libmodel/io/folder_bounds.h"
#include "libmodel/io/text_encoding.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
  return first == text.npos ? "" : text.substr(first, last - first + 1);
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

// Reads one row into an entry.
class EntryReader {
 public:
  EntryReader(const fs::path& manifest, bool outside) : manifest_(manifest), outside_(outside) {}

  ManifestEntry read(const std::vector<std::string>& columns, const CsvRow& row) const {
    ManifestEntry e;
    e.line = row.line;
    if (row.fields.size() != columns.size())
      fail(row.line,
           "has " + std::to_string(row.fields.size()) + " fields; the header has " + std::to_string(columns.size()));
    for (size_t i = 0; i < columns.size(); ++i)
      if (const std::string value = trimmed(row.fields[i]); !value.empty()) set(e, columns[i], value);
    if (e.file.empty()) fail(row.line, "names no file");
    if (e.id.empty()) e.id = as_utf8(e.file.stem().string());
    if (e.id == "." || e.id == ".." || e.id.find_first_of("/\\:") != e.id.npos)
      fail(row.line, "the id '" + e.id + "' cannot be a file name");
    if (e.subject.empty()) e.subject = e.id;
    return e;
  }

 private:
  [[noreturn]] void fail(int line, const std::string& what) const { throw IoError(manifest_.string(), line, what); }

  void set(ManifestEntry& e, const std::string& column, const std::string& value) const {
    if (column == "id")
      e.id = as_utf8(value);
    else if (column == "file")
      e.file = path(value, e.line);
    else if (column == "landmarks")
      e.landmarks = path(value, e.line);
    else if (column == "subject")
      e.subject = as_utf8(value);
    else if (column == "expression")
      e.expression = lower(value) == ManifestEntry::kNeutral ? ManifestEntry::kNeutral : as_utf8(value);
    else if (column == "group")
      e.group = as_utf8(value);
    else if (column == "age")
      e.age = age(value, e.line);
    else if (column == "units")
      e.units = units(value, e.line);
    else
      e.other[column] = as_utf8(value);
  }

  fs::path path(const std::string& value, int line) const {
    const fs::path folder = manifest_.has_parent_path() ? manifest_.parent_path() : fs::path(".");
    fs::path file = (folder / value).lexically_normal();
    if (!outside_ && !lies_inside(file, folder))
      fail(line, "'" + value + "' lies outside the manifest's folder; put the manifest beside the scans");
    if (!is_file(file)) fail(line, "there is no file '" + value + "' beside the manifest");
    return file;
  }

  double age(const std::string& value, int line) const {
    double years = -1;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), years);
    if (error != std::errc() || end != value.data() + value.size() || !(years >= 0 && years <= 130))
      fail(line, "the age '" + value + "' is no number of years from 0 to 130");
    return years;
  }

  std::string units(const std::string& value, int line) const {
    if (value == "auto") return "";
    if (value != "mm" && value != "cm" && value != "m" && value != "inch")
      fail(line, "the units '" + value + "' are none of mm, cm, m, inch, auto");
    return value;
  }

  fs::path manifest_;
  bool outside_;
};

std::vector<std::string> header_of(const std::vector<CsvRow>& rows, const fs::path& path) {
  if (rows.empty()) throw IoError(path.string(), "is empty; expected a header that names the columns, file among them");
  std::vector<std::string> columns;
  for (const std::string& field : rows[0].fields) {
    const std::string name = as_utf8(lower(trimmed(field)));
    if (name.empty()) throw IoError(path.string(), rows[0].line, "a column has no name");
    if (std::find(columns.begin(), columns.end(), name) != columns.end())
      throw IoError(path.string(), rows[0].line, "the column '" + name + "' is there twice");
    columns.push_back(name);
  }
  if (std::find(columns.begin(), columns.end(), "file") == columns.end())
    throw IoError(path.string(), rows[0].line,
                  "the header has no column 'file'; columns are id, file, landmarks, subject, expression, group, age, "
                  "units and any others");
  return columns;
}

}  // namespace

Manifest read_manifest(const fs::path& path, bool outside) {
  const std::vector<CsvRow> rows = parse_csv(read_file(path), path.string());
  Manifest manifest{path, {}, header_of(rows, path)};
  const EntryReader reader(path, outside);
  std::map<std::string, int> line_of;
  for (size_t i = 1; i < rows.size(); ++i) {
    ManifestEntry entry = reader.read(manifest.columns, rows[i]);
    const auto [first, is_new] = line_of.try_emplace(entry.id, entry.line);
    if (!is_new)
      throw IoError(path.string(), entry.line,
                    "the id '" + entry.id + "' is that of line " + std::to_string(first->second) + " too");
    manifest.entries.push_back(std::move(entry));
  }
  if (manifest.entries.empty()) throw IoError(path.string(), "names no scan");
  return manifest;
}

}  // namespace facewright
