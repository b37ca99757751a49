// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/eos_companions.h"

#include <nlohmann/json.hpp>
#include <sstream>

#include "libmodel/interop/eos_binary.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/json_whole.h"

namespace facewright {
namespace {

using nlohmann::json;

template <class Take>
auto from_json(const std::filesystem::path& path, Take take) {
  const json value = json::parse(read_file(path), nullptr, /*allow_exceptions=*/false);
  if (value.is_discarded()) throw IoError(path.string(), "is not JSON");
  try {
    return take(value);
  } catch (const json::exception& error) {
    throw IoError(path.string(), std::string("has an unexpected content: ") + error.what());
  }
}

std::pair<int, int> one_based_pair(const std::filesystem::path& path, const json& entry, int least) {
  const int a = whole_number<int>(entry.at("value0")), b = whole_number<int>(entry.at("value1"));
  if (a < least || b < 1) throw IoError(path.string(), "has an index below 1, from which eos counts");
  return {a - 1, b - 1};
}

// The items of a TOML list `[1, "two"]`.
std::vector<std::string> list_items(const std::filesystem::path& path, int line, const std::string& text) {
  const size_t open = text.find('['), close = text.find(']');
  if (open == text.npos || close == text.npos || close < open)
    throw IoError(path.string(), line, "expected 'right = [names or vertices]'");
  std::vector<std::string> items;
  std::istringstream list(text.substr(open + 1, close - open - 1));
  for (std::string item; std::getline(list, item, ',');) {
    const size_t first = item.find_first_not_of(" \t\"'"), last = item.find_last_not_of(" \t\"'");
    if (first != item.npos) items.push_back(item.substr(first, last - first + 1));
  }
  return items;
}

}  // namespace

std::string eos_blendshapes_bytes(const std::vector<Blendshape>& blendshapes) {
  ByteWriter out;
  write_eos_blendshapes(out, blendshapes);
  return out.take();
}

std::vector<Blendshape> read_eos_blendshapes(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  ByteReader in(bytes, path.string());
  std::vector<Blendshape> result = read_eos_blendshape_list(in);
  if (!in.at_end()) in.fail("goes on after the last blendshape");
  return result;
}

FaceContours read_eos_contours(const std::filesystem::path& path) {
  return from_json(path, [](const json& file) {
    const json& contours = file.at("model_contour");
    return FaceContours{whole_numbers(contours.at("right_contour")), whole_numbers(contours.at("left_contour"))};
  });
}

std::vector<Edge> read_eos_edge_topology(const std::filesystem::path& path) {
  return from_json(path, [&](const json& file) {
    const json &faces = file.at("edge_topology").at("adjacent_faces"),
               &vertices = file.at("edge_topology").at("adjacent_vertices");
    if (faces.size() != vertices.size())
      throw IoError(path.string(), "has " + std::to_string(faces.size()) + " edges with faces, " +
                                       std::to_string(vertices.size()) + " with vertices; expected as many");
    std::vector<Edge> edges;
    for (size_t i = 0; i < faces.size(); ++i) {
      const auto [missing_or_f0, f] = one_based_pair(path, faces[i], 0);  // value0 = 0: one triangle only
      const auto [v0, v1] = one_based_pair(path, vertices[i], 1);
      edges.push_back(missing_or_f0 < 0 ? Edge{v0, v1, f, -1} : Edge{v0, v1, missing_or_f0, f});
    }
    return edges;
  });
}

EosContourLandmarks read_eos_contour_landmarks(const std::filesystem::path& path) {
  EosContourLandmarks result;
  std::istringstream text(read_file(path));
  bool inside = false, found = false;
  int number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    line = line.substr(0, line.find('#'));
    const size_t first = line.find_first_not_of(" \t\r");
    if (first == line.npos) continue;
    if (line[first] == '[') {
      inside = line.compare(first, 19, "[contour_landmarks]") == 0;
      found |= inside;
    } else if (inside) {
      (line.compare(first, 5, "right") == 0 ? result.right : result.left) = list_items(path, number, line);
    }
  }
  if (!found) throw IoError(path.string(), "has no section [contour_landmarks]");
  return result;
}

}  // namespace facewright
