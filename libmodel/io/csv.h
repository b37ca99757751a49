// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace facewright {

struct CsvRow {
  std::vector<std::string> fields;
  int line = 0;  ///< where it begins, from 1
};

/// The rows of a table of RFC 4180: quoted fields may hold separators, line ends and doubled quotes; rows end with LF
/// or CRLF; empty lines and a byte order mark are skipped. The separator is the first of , ; and tab that the first
/// line holds outside quotes. Throws IoError (`path`, line) for a quote that never ends or text behind one.
std::vector<CsvRow> parse_csv(std::string_view text, const std::string& path);

/// A field as it stands in a file: in quotes if it must be.
std::string csv_field(const std::string& text);

/// One row with its line end (CRLF).
std::string csv_line(const std::vector<std::string>& fields);

}  // namespace facewright
