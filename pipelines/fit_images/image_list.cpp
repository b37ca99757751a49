// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/fit_images/image_list.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <regex>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

bool is_picture(const fs::path& file) {
  static const std::vector<std::string> known = {".png", ".jpg", ".jpeg", ".bmp", ".tga", ".ppm", ".pgm"};
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return std::find(known.begin(), known.end(), extension) != known.end();
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// "frame_2" before "frame_10": runs of digits compare as numbers.
bool before(const std::string& a, const std::string& b) {
  size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      const auto run = [](const std::string& s, size_t& at) {
        while (at < s.size() && s[at] == '0') ++at;
        const size_t first = at;
        while (at < s.size() && is_digit(s[at])) ++at;
        return s.substr(first, at - first);
      };
      const std::string x = run(a, i), y = run(b, j);
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
    } else if (a[i] != b[j]) {
      return a[i] < b[j];
    } else {
      ++i, ++j;
    }
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;  // leading zeros alone
}

void sort_naturally(std::vector<fs::path>& files) {
  std::sort(files.begin(), files.end(),
            [](const fs::path& a, const fs::path& b) { return before(a.filename().string(), b.filename().string()); });
}

template <class Keep>
std::vector<fs::path> files_of(const fs::path& folder, Keep keep) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && keep(entry.path())) files.push_back(entry.path());
  sort_naturally(files);
  return files;
}

// The file names of a numbered sequence as a regular expression, or nothing if `name` has no %d.
std::optional<std::regex> sequence_expression(const std::string& name) {
  static const std::regex number("%(0([1-9]))?d");
  std::smatch found;
  if (!std::regex_search(name, found, number)) return {};
  const auto literal = [](const std::string& text) {
    return std::regex_replace(text, std::regex(R"([.^$|()\[\]{}*+?\\])"), R"(\$&)");
  };
  const std::string digits = found[2].matched ? "[0-9]{" + found[2].str() + ",}" : "[0-9]+";
  return std::regex(literal(found.prefix()) + digits + literal(found.suffix()));
}

std::vector<fs::path> images_of(const std::string& name) {
  const fs::path path = name;
  if (fs::is_regular_file(path)) return {path};
  if (fs::is_directory(path)) {
    std::vector<fs::path> files = files_of(path, is_picture);
    if (files.empty()) throw InvalidInput(name + ": the folder holds no picture (png, jpg, bmp, tga, ppm, pgm)");
    return files;
  }
  if (const auto expression = sequence_expression(path.filename().string())) {
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    if (!fs::is_directory(folder)) throw InvalidInput(name + ": there is no folder " + folder.string());
    std::vector<fs::path> files =
        files_of(folder, [&](const fs::path& file) { return std::regex_match(file.filename().string(), *expression); });
    if (files.empty()) throw InvalidInput(name + ": no file of this form in " + folder.string());
    return files;
  }
  throw InvalidInput(name +
                     ": expected an image, a folder of images or a sequence such as frame_%04d.png; there is none");
}

}  // namespace

std::vector<fs::path> list_images(const std::vector<std::string>& names) {
  std::vector<fs::path> images;
  std::map<std::string, fs::path> of_stem;
  for (const std::string& name : names)
    for (const fs::path& image : images_of(name)) {
      const auto [entry, is_new] = of_stem.try_emplace(image.stem().string(), image);
      if (!is_new)
        throw InvalidInput(image.string() + " and " + entry->second.string() +
                           " have the same stem, and so would their results; rename one or fit them in two runs");
      images.push_back(image);
    }
  return images;
}

}  // namespace facewright
