// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/exported_levels.h"

#include <algorithm>
#include <charconv>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "libmodel/core/errors.h"
#include "libmodel/interop/eos_companions.h"
#include "libmodel/interop/eos_model.h"
#include "libmodel/interop/gltf.h"
#include "libmodel/interop/level_files.h"
#include "libmodel/interop/npz.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/json_whole.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"
#include "libmodel/model/surface_points.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json read_json(const fs::path& path) {
  json value = json::parse(read_file(path), nullptr, /*allow_exceptions=*/false);
  if (value.is_discarded()) throw IoError(path.string(), "is not JSON");
  return value;
}

std::vector<int> read_symmetry(const fs::path& path) {
  std::vector<int> mirror;
  std::istringstream in(read_file(path));
  for (std::string line; std::getline(in, line);) {
    int partner = 0;
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), partner);
    if (error != std::errc()) throw IoError(path.string(), static_cast<int>(mirror.size()) + 1, "expected a number");
    mirror.push_back(partner - 1);
  }
  return mirror;
}

void read_contours(const fs::path& path, MorphableModelParts& p) {
  FaceContours contours = read_eos_contours(path);
  p.regions["right_contour"] = std::move(contours.right);
  p.regions["left_contour"] = std::move(contours.left);
}

void read_places(const fs::path& path, MorphableModelParts& p) {
  const json places = read_json(path);
  for (const auto& [name, entry] : places.items()) {
    if (whole_number<int>(entry.at("vertex")) >= 0) continue;
    const auto b = entry.at("barycentric").get<std::array<double, 3>>();
    p.levels.back().landmark_points[name] = {whole_number<int>(entry.at("triangle")), {b[0], b[1], b[2]}};
  }
}

void read_parents(const fs::path& path, MorphableModelParts& p) {
  const json table = read_json(path);
  for (const json& entry : table.at("parents"))
    p.parents.push_back({whole_number<int>(entry.at(0)), whole_number<int>(entry.at(1)),
                         entry.size() > 2 ? whole_number<int>(entry.at(2)) : -1});
}

// The stored topology must be that of the triangles: compared as text, which is how it was written.
void check_edges(const fs::path& path, const Faces& F) {
  if (read_file(path) != edge_topology_json(F)) throw IoError(path.string(), "is not the edge topology of its mesh");
}

// Everything but JSON of an unexpected kind already says what is wrong.
MorphableModel guarded(const fs::path& path, const std::function<MorphableModel()>& read) {
  try {
    return read();
  } catch (const json::exception& error) {
    throw IoError(path.string(), std::string("has an unexpected content: ") + error.what());
  } catch (const InvalidInput& error) {
    throw IoError(path.string(), error.what());
  }
}

MorphableModelParts parts_of(const Mesh& mesh) {
  MorphableModelParts p;
  p.shape.mean = as_vector(mesh.V);
  p.shape.basis.resize(p.shape.mean.size(), 0);
  if (mesh.has_colours()) {
    p.colour.mean = as_vector(mesh.colours);
    p.colour.basis.resize(p.colour.mean.size(), 0);
  }
  p.uv = mesh.uv;
  p.levels = {{static_cast<int>(mesh.V.rows()), mesh.F}};
  return p;
}

MorphableModel read_eos_with_companions(const fs::path& path) {
  return guarded(path, [&] {
    const MorphableModel model = read_eos_model(path);
    MorphableModelParts p = model.parts();
    const fs::path stem = path.parent_path() / path.stem();
    const auto companion = [&](const char* end) { return fs::path(stem.string() + end); };
    if (fs::exists(companion("_contours.json"))) read_contours(companion("_contours.json"), p);
    if (fs::exists(companion("_blendshapes.bin"))) p.blendshapes = read_eos_blendshapes(companion("_blendshapes.bin"));
    if (fs::exists(companion("_symmetry.txt"))) p.mirror = read_symmetry(companion("_symmetry.txt"));
    if (fs::exists(companion("_edge_topology.json"))) check_edges(companion("_edge_topology.json"), p.levels[0].F);
    return MorphableModel(std::move(p));
  });
}

MorphableModel read_whole(const fs::path& path) {
  try_model_file(path);
  return load_model(path);
}

// The files name(count) that are there, by their count, ascending.
template <class Name>
std::map<int, fs::path> by_count(const std::vector<int>& counts, Name name) {
  std::map<int, fs::path> files;
  for (const int n : counts)
    if (const fs::path file = name(std::to_string(n)); fs::exists(file)) files[n] = file;
  return files;
}

ExportNesting nesting_of(const std::string& label, const std::map<int, fs::path>& files,
                         const std::function<MorphableModel(const fs::path&)>& read) {
  ExportNesting result{label, {}};
  MorphableModel coarse;
  for (const auto& [count, path] : files) {
    MorphableModel level = read(path);
    if (level.vertex_count() != count)
      throw IoError(path.string(), "has " + std::to_string(level.vertex_count()) + " vertices, its name says " +
                                       std::to_string(count));
    if (!coarse.empty())
      for (NestingRow& row : compare_levels(coarse, level)) result.rows.push_back(std::move(row));
    coarse = std::move(level);
  }
  return result;
}

}  // namespace

MorphableModel read_level_folder(const fs::path& folder) {
  return guarded(folder, [&] {
    MorphableModelParts p = parts_of(read_mesh(folder / "mean.ply"));
    const Faces& F = p.levels.back().F;
    const json vertices = read_json(folder / "landmark_vertices.json");
    for (const auto& [name, v] : vertices.items())
      p.landmarks[name] = {point_at_vertex(F, whole_number<int>(v)), whole_number<int>(v)};
    read_places(folder / "landmark_points.json", p);
    const json regions = read_json(folder / "regions.json");
    for (const auto& [name, vertices_of] : regions.items()) p.regions[name] = whole_numbers(vertices_of);
    read_contours(folder / "contours.json", p);
    check_edges(folder / "edge_topology.json", F);
    if (fs::exists(folder / "symmetry.txt")) p.mirror = read_symmetry(folder / "symmetry.txt");
    if (fs::exists(folder / "parents.json")) read_parents(folder / "parents.json", p);
    return MorphableModel(std::move(p));
  });
}

std::vector<int> level_counts(const MorphableModel& model) {
  std::vector<int> counts;
  for (const ModelLevel& level : model.levels()) counts.push_back(level.vertex_count);
  return counts;
}

std::vector<ExportNesting> nesting_of_level_folders(const fs::path& levels, const std::vector<int>& counts) {
  const auto folders = by_count(counts, [&](const std::string& n) { return levels / n; });
  if (folders.empty()) return {};
  return {nesting_of("levels/V/mean.ply and companions", folders, read_level_folder),
          nesting_of("levels/V/mean.obj", folders, [](const fs::path& folder) {
            return guarded(folder / "mean.obj",
                           [&] { return MorphableModel(parts_of(read_mesh(folder / "mean.obj"))); });
          })};
}

std::vector<ExportNesting> nesting_of_exports(const fs::path& folder, const std::vector<int>& counts) {
  std::vector<ExportNesting> proof;
  const auto add = [&](const std::string& prefix, const std::string& suffix, auto read) {
    const auto files = by_count(counts, [&](const std::string& n) { return folder / (prefix + n + suffix); });
    if (!files.empty()) proof.push_back(nesting_of("export/" + prefix + "V" + suffix, files, read));
  };
  add("eos_", ".bin", read_eos_with_companions);
  add("statismo_", ".h5", read_whole);
  add("model_", ".npz", read_npz_model);
  add("model_", ".glb", read_glb_model);
  return proof;
}

std::vector<ExportNesting> exported_nesting(const fs::path& output, const std::vector<int>& counts) {
  std::vector<ExportNesting> proof = nesting_of_level_folders(output / "levels", counts);
  for (ExportNesting& e : nesting_of_exports(output / "export", counts)) proof.push_back(std::move(e));
  if (proof.empty())
    throw InvalidInput(output.string() + ": there is no level of this model in levels/ or export/ in it");
  return proof;
}

std::string nesting_json(const std::vector<ExportNesting>& proof) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const ExportNesting& e : proof)
    for (const NestingRow& r : e.rows) {
      nlohmann::ordered_json row = {{"file", e.file},     {"coarse", r.coarse},           {"fine", r.fine},
                                    {"what", r.quantity}, {"max_deviation", r.deviation}, {"allowed", r.tolerance},
                                    {"nested", r.holds()}};
      if (!r.unit.empty()) row["unit"] = r.unit;
      list.push_back(std::move(row));
    }
  return list.dump(1) + "\n";
}

}  // namespace facewright
