// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/level_files.h"

#include <nlohmann/json.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/interop/exported_levels.h"
#include "libmodel/interop/uv_wireframe.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kWireframeSize = 1024;  // pixels

// What was written is read back: the mean must be the model's in the files' precision, and the level the leading part
// of the next finer one.
void prove_nesting(const MorphableModel& model, int level, const std::filesystem::path& folder) {
  const Mesh mean = model.mean(level);
  const auto back = [&](const char* file, const Vertices& expected) {
    const double deviation = (read_mesh(folder / file).V - expected).cwiseAbs().maxCoeff();
    return ExportNesting{
        file,
        {{model.vertex_count(level), model.vertex_count(level), "positions as in the model", deviation, 0, "mm"}}};
  };
  std::vector<ExportNesting> proof = {back("mean.ply", mean.V.cast<float>().cast<double>()), back("mean.obj", mean.V)};
  if (level + 1 < model.level_count())
    proof.push_back({"model", compare_levels(model.level(level), model.level(level + 1))});
  write_file(folder / "nesting.json", nesting_json(proof));
  for (const ExportNesting& e : proof)
    for (const NestingRow& row : e.rows)
      if (!row.holds())
        throw SolverError("export: level " + std::to_string(row.coarse) + " does not nest: " + row.quantity + " of " +
                          e.file + " differ by " + std::to_string(row.deviation));
}

}  // namespace

std::string landmark_vertices_json(const LandmarkSet& landmarks) {
  Json table = Json::object();
  for (const auto& [name, mark] : landmarks) table[name] = mark.vertex;
  return table.dump() + "\n";
}

std::string landmark_points_json(const MorphableModel& model, int level) {
  Json table = Json::object();
  for (const auto& [name, mark] : model.landmarks(level)) {
    const Eigen::Vector3d& b = mark.point.barycentric;
    table[name] = {{"triangle", mark.point.triangle}, {"barycentric", {b[0], b[1], b[2]}}, {"vertex", mark.vertex}};
  }
  return table.dump() + "\n";
}

std::string regions_json(const MorphableModel& model, int level) {
  Json table = Json::object();
  for (const auto& [name, vertices] : model.regions(level))
    if (!name.ends_with("_contour")) table[name] = vertices;
  return table.dump() + "\n";
}

std::string contours_json(const MorphableModel& model, int level) {
  const FaceContours contours = model.contours(level);
  Json json;
  json["model_contour"]["right_contour"] = contours.right;
  json["model_contour"]["left_contour"] = contours.left;
  return json.dump() + "\n";
}

std::string symmetry_text(const std::vector<int>& mirror, int vertex_count) {
  std::string text;
  for (int v = 0; v < vertex_count; ++v)
    text += std::to_string(mirror[static_cast<size_t>(v)] + 1) +
            (v == 0 ? " # symmetric counterpart of each vertex, 1-based\n" : "\n");
  return text;
}

std::string edge_topology_json(const Faces& F) {
  Json faces = Json::array(), vertices = Json::array();
  for (const Edge& e : edges(F)) {
    // eos puts the missing face of a boundary edge first.
    faces.push_back({{"value0", e.is_boundary() ? 0 : e.f0 + 1}, {"value1", (e.is_boundary() ? e.f0 : e.f1) + 1}});
    vertices.push_back({{"value0", e.v0 + 1}, {"value1", e.v1 + 1}});
  }
  Json json;
  json["edge_topology"] = {{"adjacent_faces", std::move(faces)}, {"adjacent_vertices", std::move(vertices)}};
  return json.dump() + "\n";
}

std::string parents_json(const MorphableModel& model, int level) {
  const int base = model.base_vertex_count();
  Json list = Json::array();
  for (int v = base; v < model.vertex_count(level); ++v) {
    const VertexParents& p = model.parents()[static_cast<size_t>(v - base)];
    list.push_back(p.is_midpoint() ? Json{p.a, p.b} : Json{p.a, p.b, p.c});
  }
  const Json json = {{"first_vertex", base}, {"parents", std::move(list)}};
  return json.dump() + "\n";
}

void export_level_files(const MorphableModel& model, int level, const std::filesystem::path& folder) {
  const Mesh mean = model.mean(level);
  write_ply(folder / "mean.ply", mean);
  write_obj(folder / "mean.obj", mean);
  if (mean.has_uv()) write_png(folder / "isomap.png", uv_wireframe(mean.uv, mean.F, kWireframeSize));
  write_landmarks(folder / "landmarks.json", locate(model.landmarks(level), mean.V, mean.F));
  write_file(folder / "landmark_vertices.json", landmark_vertices_json(model.landmarks()));
  write_file(folder / "landmark_points.json", landmark_points_json(model, level));
  write_file(folder / "regions.json", regions_json(model, level));
  write_file(folder / "contours.json", contours_json(model, level));
  write_file(folder / "edge_topology.json", edge_topology_json(mean.F));
  if (!model.mirror().empty())
    write_file(folder / "symmetry.txt", symmetry_text(model.mirror(), model.vertex_count(level)));
  if (!model.parents().empty()) write_file(folder / "parents.json", parents_json(model, level));
  prove_nesting(model, level, folder);
}

}  // namespace facewright
