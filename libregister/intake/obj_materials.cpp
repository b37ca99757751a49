// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/obj_materials.h"

#include <algorithm>
#include <map>
#include <string_view>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

std::string_view next_line(std::string_view* text) {
  const size_t end = std::min(text->find('\n'), text->size());
  std::string_view line = text->substr(0, end);
  text->remove_prefix(std::min(end + 1, text->size()));
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ' || line.back() == '\t')) line.remove_suffix(1);
  while (!line.empty() && (line.front() == ' ' || line.front() == '\t')) line.remove_prefix(1);
  return line;
}

std::string_view first_word(std::string_view* line) {
  const size_t end = std::min(line->find_first_of(" \t"), line->size());
  const std::string_view word = line->substr(0, end);
  line->remove_prefix(end);
  while (!line->empty() && (line->front() == ' ' || line->front() == '\t')) line->remove_prefix(1);
  return word;
}

// "-s 1 1 1 -clamp on skin.png": options and their values stand before the name, which may hold blanks.
std::string picture_name(std::string_view text) {
  while (text.starts_with("-")) {
    first_word(&text);
    while (!text.empty() && !text.starts_with("-")) {
      std::string_view rest = text;
      const std::string_view value = first_word(&rest);
      const bool is_value = value == "on" || value == "off" || value.find_first_not_of("0123456789.+-eE") == value.npos;
      if (!is_value) return std::string(text);
      text = rest;
    }
  }
  return std::string(text);
}

std::map<std::string, std::string> pictures_of_materials(const std::string& text) {
  std::map<std::string, std::string> result;
  std::string_view rest = text;
  std::string material;
  while (!rest.empty()) {
    std::string_view line = next_line(&rest);
    const std::string_view word = first_word(&line);
    if (word == "newmtl") material = std::string(line);
    if (word == "map_Kd" || word == "map_kd") result[material] = picture_name(line);
  }
  return result;
}

int corners(std::string_view line) {
  int n = 0;
  while (!line.empty()) first_word(&line), ++n;
  return n;
}

}  // namespace

ObjTextures read_obj_textures(const fs::path& obj) {
  ObjTextures result;
  const std::string text = read_file(obj);
  std::map<std::string, std::string> of_material;
  std::map<std::string, int> place;
  int current = -1;
  std::string_view rest = text;
  while (!rest.empty()) {
    std::string_view line = next_line(&rest);
    if (line.empty() || (line[0] != 'f' && line[0] != 'm' && line[0] != 'u')) continue;
    const std::string_view word = first_word(&line);
    if (word == "mtllib") {
      try {
        for (const auto& entry : pictures_of_materials(read_file(obj.parent_path() / fs::path(line).filename())))
          of_material.insert(entry);
      } catch (const IoError&) {
        result.warnings.push_back("material file '" + std::string(line) + "' is missing: no texture");
      }
    } else if (word == "usemtl") {
      const auto known = of_material.find(std::string(line));
      current = -1;
      if (known == of_material.end() || known->second.empty()) continue;
      const auto [at, is_new] = place.try_emplace(known->second, static_cast<int>(result.pictures.size()));
      if (is_new) result.pictures.push_back(known->second);
      current = at->second;
    } else if (word == "f") {
      result.of_triangle.insert(result.of_triangle.end(), static_cast<size_t>(std::max(0, corners(line) - 2)), current);
    }
  }
  // Scanners' files with one material often forget to use it.
  if (place.empty() && of_material.size() == 1 && !of_material.begin()->second.empty()) {
    result.pictures = {of_material.begin()->second};
    std::fill(result.of_triangle.begin(), result.of_triangle.end(), 0);
  }
  return result;
}

}  // namespace facewright
