// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/csv.h"

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

char separator_of(std::string_view text) {
  bool quoted = false;
  for (const char c : text) {
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    if (c == ',' || c == ';' || c == '\t') return c;
    if (c == '\n') break;
  }
  return ',';
}

// One row after the other.
class CsvParser {
 public:
  CsvParser(std::string_view text, const std::string& path) : text_(text), path_(path) {
    if (text_.starts_with("\xef\xbb\xbf")) text_.remove_prefix(3);
    separator_ = separator_of(text_);
  }

  std::vector<CsvRow> rows() {
    std::vector<CsvRow> result;
    while (at_ < text_.size()) {
      CsvRow row{{}, line_};
      do row.fields.push_back(field());
      while (take(separator_));
      end_of_row();
      if (row.fields.size() > 1 || !row.fields[0].empty()) result.push_back(std::move(row));
    }
    return result;
  }

 private:
  bool take(char c) {
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  std::string field() {
    if (take('"')) return quoted_field();
    const size_t first = at_;
    while (at_ < text_.size() && text_[at_] != separator_ && text_[at_] != '\n' && text_[at_] != '\r') ++at_;
    return std::string(text_.substr(first, at_ - first));
  }

  std::string quoted_field() {
    const int first_line = line_;
    std::string value;
    while (at_ < text_.size()) {
      const char c = text_[at_++];
      if (c == '"' && !take('"')) return value;  // of a doubled quote one is kept
      line_ += c == '\n';
      value += c;
    }
    throw IoError(path_, first_line, "a quote is opened and never closed");
  }

  void end_of_row() {
    while (take('\r')) {
    }
    if (at_ < text_.size() && !take('\n'))
      throw IoError(path_, line_, "text follows a closing quote; double the quotes that belong to the text");
    ++line_;
  }

  std::string_view text_;
  std::string path_;
  char separator_;
  size_t at_ = 0;
  int line_ = 1;
};

}  // namespace

std::vector<CsvRow> parse_csv(std::string_view text, const std::string& path) { return CsvParser(text, path).rows(); }

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",;\t\"\r\n") == text.npos) return text;
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? "\"\"" : std::string(1, c);
  return result + "\"";
}

std::string csv_line(const std::vector<std::string>& fields) {
  std::string line;
  for (size_t i = 0; i < fields.size(); ++i) line += (i ? "," : "") + csv_field(fields[i]);
  return line + "\r\n";
}

}  // namespace facewright
