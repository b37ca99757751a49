// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/extension_reader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "libmodel/io/json_whole.h"
#include "libmodel/model/representer_reader.h"

namespace facewright {
namespace {

using nlohmann::json;

// What `take` makes of the JSON text at `path`; JSON of another kind than `take` expects is an error of the file.
template <class Take>
auto from_json(const Hdf5Reader& h5, const std::string& path, Take take) {
  const json value = json::parse(h5.string(path), nullptr, /*allow_exceptions=*/false);
  if (value.is_discarded()) h5.fail(path, "is not JSON");
  try {
    return take(value);
  } catch (const json::exception& error) {
    h5.fail(path, std::string("has an unexpected content: ") + error.what());
  }
}

template <class T>
T from_json(const Hdf5Reader& h5, const std::string& path) {
  return from_json(h5, path, [](const json& value) { return value.get<T>(); });
}

// {"name":[1,2,3],...} as it is written here, without the tree of a general reader; nothing for any other text.
std::optional<std::map<std::string, std::vector<int>>> plain_lists(const std::string& text) {
  std::map<std::string, std::vector<int>> lists;
  const char *at = text.data(), *end = at + text.size();
  const auto take = [&](char c) { return at != end && *at == c && ++at; };
  if (!take('{')) return std::nullopt;
  do {
    if (!take('"')) return std::nullopt;
    const char* quote = std::find(at, end, '"');
    const std::string name(at, quote);
    if (quote == end || name.find('\\') != name.npos) return std::nullopt;
    at = quote + 1;
    if (!take(':') || !take('[')) return std::nullopt;
    std::vector<int>& list = lists[name];
    while (!take(']')) {
      if (!list.empty() && !take(',')) return std::nullopt;
      const auto [next, error] = std::from_chars(at, end, list.emplace_back());
      if (error != std::errc()) return std::nullopt;
      at = next;
    }
  } while (take(','));
  if (!take('}') || at != end) return std::nullopt;
  return lists;
}

std::map<std::string, std::vector<int>> read_regions(const Hdf5Reader& h5, const std::string& path) {
  if (auto lists = plain_lists(h5.string(path))) return *std::move(lists);
  return from_json(h5, path, [](const json& table) {
    std::map<std::string, std::vector<int>> regions;
    for (const auto& [name, vertices] : table.items()) regions[name] = whole_numbers(vertices);
    return regions;
  });
}

using Coordinates = std::map<std::string, Eigen::Vector3d>;

Coordinates read_landmarks_json(const Hdf5Reader& h5, const std::string& path) {
  return from_json(h5, path, [](const json& list) {
    Coordinates found;
    for (const json& entry : list) {
      const auto x = entry.at("coordinates").get<std::array<double, 3>>();
      found[entry.at("id").get<std::string>()] = {x[0], x[1], x[2]};
    }
    return found;
  });
}

// Lines "name visible x y z"; invisible ones are no landmarks.
Coordinates read_landmarks_text(const Hdf5Reader& h5, const std::string& path) {
  Coordinates found;
  std::istringstream text(h5.string(path));
  int number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    if (line.find_first_not_of(" \t\r") == line.npos) continue;
    std::istringstream words(line);
    std::string name;
    double visible = 0;
    Eigen::Vector3d x;
    if (!(words >> name >> visible >> x[0] >> x[1] >> x[2]))
      h5.fail(path, "has line " + std::to_string(number) + " '" + line + "'; expected 'name visible x y z'");
    if (visible != 0) found[name] = x;
  }
  return found;
}

std::vector<Blendshape> read_blendshapes(const Hdf5Reader& h5, const std::string& at, Eigen::Index values) {
  std::vector<Blendshape> result;
  if (!h5.has(at)) return result;
  const auto names = from_json<std::vector<std::string>>(h5, at + "/names");
  const RowMatrixXd rows = h5.matrix(at + "/displacements");
  if (rows.rows() != static_cast<Eigen::Index>(names.size()) || rows.cols() != values)
    h5.fail(at + "/displacements", "is " + std::to_string(rows.rows()) + " x " + std::to_string(rows.cols()) +
                                       "; expected " + std::to_string(names.size()) + " x " + std::to_string(values) +
                                       " from names and mean");
  for (size_t i = 0; i < names.size(); ++i) result.push_back({names[i], rows.row(static_cast<Eigen::Index>(i))});
  return result;
}

void expect_text(const Hdf5Reader& h5, const std::string& path, const std::string& expected) {
  if (!h5.has(path)) return;
  if (const std::string text = h5.string(path); text != expected)
    h5.fail(path, "is '" + text + "'; expected '" + expected + "'. Convert the model and its statistics");
}

}  // namespace

LandmarkSet read_landmarks_of(const Hdf5Reader& h5, const std::string& metadata, const PcaModel& shape) {
  LandmarkSet marks;
  const std::string vertices = metadata + "/ext/landmark_vertices", coordinates = metadata + "/landmarks/json",
                    text = metadata + "/landmarks/text";
  if (h5.has(vertices)) {
    return from_json(h5, vertices, [&](const json& table) {
      for (const auto& [name, v] : table.items()) marks[name].vertex = whole_number<int>(v);
      return marks;
    });
  }
  const std::string path = h5.has(coordinates) ? coordinates : text;
  if (!h5.has(path)) return marks;
  if (shape.empty()) h5.fail(path, "names landmarks of a mean without vertices");
  const Coordinates found = path == text ? read_landmarks_text(h5, path) : read_landmarks_json(h5, path);
  for (const auto& [name, x] : found) {
    Eigen::Index v = 0;
    (as_vertices(shape.mean).rowwise() - x.transpose()).rowwise().squaredNorm().minCoeff(&v);
    marks[name].vertex = static_cast<int>(v);
  }
  return marks;
}

std::map<std::string, SurfacePoint, LandmarkNameOrder> read_landmark_points(const Hdf5Reader& h5,
                                                                            const std::string& ext) {
  std::map<std::string, SurfacePoint, LandmarkNameOrder> points;
  const std::string path = ext + "/landmark_points";
  if (!h5.has(path)) return points;
  // Most models have all their landmarks at vertices, of which only their vertex is wanted.
  if (h5.has(ext + "/format") && h5.string(path).find("\"vertex\":-1") == std::string::npos) return points;
  return from_json(h5, path, [&](const json& table) {
    for (const auto& [name, entry] : table.items()) {
      const auto b = entry.at("barycentric").get<std::array<double, 3>>();
      const auto number = [&entry = entry](const char* key) {
        return entry.contains(key) ? whole_number<int>(entry.at(key)) : -1;
      };
      if (number("vertex") < 0) points[name] = {number("triangle"), {b[0], b[1], b[2]}};
    }
    return points;
  });
}

void check_format(const Hdf5Reader& h5, const std::string& ext) {
  if (!h5.has(ext + "/format")) return;
  const std::string format = h5.string(ext + "/format"), known = "facewright-model ";
  if (format != known + "1" && format != known + "2" && format != known + "3")
    h5.fail(ext + "/format", "is '" + format +
                                 "'; this version reads 'facewright-model 1' to 3. Was it written by a newer one? "
                                 "Update Facewright");
  expect_text(h5, ext + "/length_unit", kLengthUnit);
  expect_text(h5, ext + "/axes", kAxes);
  expect_text(h5, ext + "/winding", kWinding);
}

void read_extension(const Hdf5Reader& h5, const std::string& at, MorphableModelParts& parts) {
  if (h5.has(at + "/uv")) {
    const RowMatrixXd uv = h5.matrix(at + "/uv");
    if (uv.cols() != 2) h5.fail(at + "/uv", "has " + std::to_string(uv.cols()) + " columns; expected 2");
    parts.uv = uv;
  }
  if (h5.has(at + "/mirror")) {
    const RowMatrixXi mirror = h5.integers(at + "/mirror");
    parts.mirror.assign(mirror.data(), mirror.data() + mirror.size());
  }
  if (h5.has(at + "/parents")) {
    const Faces table = read_index_triples(h5, at + "/parents");
    parts.parents.reserve(static_cast<size_t>(table.rows()));
    for (Eigen::Index i = 0; i < table.rows(); ++i) parts.parents.push_back({table(i, 0), table(i, 1), table(i, 2)});
  }
  if (h5.has(at + "/base_faces")) parts.base_faces = read_index_triples(h5, at + "/base_faces");
  parts.levels.back().landmark_points = read_landmark_points(h5, at);
  parts.blendshapes = read_blendshapes(h5, at + "/blendshapes", parts.shape.mean.size());
  if (h5.has(at + "/regions")) parts.regions = read_regions(h5, at + "/regions");
  if (h5.has(at + "/provenance")) parts.provenance = from_json<decltype(parts.provenance)>(h5, at + "/provenance");
}

}  // namespace facewright
