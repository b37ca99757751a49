// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace facewright {

/// A scan as a manifest describes it. Everything but `file` may be left out.
struct ManifestEntry {
  std::string id;                            ///< the file's stem unless the manifest says otherwise
  std::filesystem::path file;                ///< the mesh, absolute or as seen from the current folder
  std::filesystem::path landmarks;           ///< empty: look beside the mesh
  std::string subject;                       ///< the person; the id unless the manifest says otherwise
  std::string expression = kNeutral;         ///< "neutral" or any other name
  std::string group;                         ///< of the model card, such as a demographic group; empty: not stated
  std::optional<double> age;                 ///< years
  std::string units;                         ///< "mm", "cm", "m", or empty: as the program is told
  std::map<std::string, std::string> other;  ///< further columns, as text
  int line = 0;                              ///< in the manifest

  static constexpr const char* kNeutral = "neutral";
  bool neutral() const { return expression == kNeutral; }
};

struct Manifest {
  std::filesystem::path path;
  std::vector<ManifestEntry> entries;  ///< in the order of the file
  std::vector<std::string> columns;    ///< names of the header
};

/// Reads a table of scans: CSV by RFC 4180 (quotes, line ends within them, LF or CRLF, a byte order mark is skipped),
/// separated by commas, semicolons or tabs, whichever the header uses. The header names columns in any order: id, file,
/// landmarks, subject, expression, group, age, units; others are kept as text. Paths are relative to the manifest and
/// stay inside its folder unless `outside` allows more. Throws IoError with the line: no column `file`, rows of another
/// length than the header, ages that are no number from 0 to 130, unknown units, ids that repeat or are no file name,
/// files that do not exist.
Manifest read_manifest(const std::filesystem::path& path, bool outside = false);

}  // namespace facewright
