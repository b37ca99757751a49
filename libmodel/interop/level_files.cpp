// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/level_files.h"

#include <limits>
#include <nlohmann/json.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/core/image.h"
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

// What mean.ply and its companions hold of a level: no modes, positions and texture coordinates as float32, colours as
// bytes of sRGB, contours as regions.
MorphableModel as_in_files(const MorphableModel& model, int level) {
  MorphableModelParts p = model.level(level).parts();
  const auto mean_alone = [](const Eigen::VectorXd& mean) {
    return PcaModel{mean, Eigen::MatrixXd(mean.size(), 0), {}};
  };
  p.shape = mean_alone(p.shape.mean.cast<float>().cast<double>());
  if (!p.colour.empty())
    p.colour =
        mean_alone(p.colour.mean.unaryExpr([](double c) { return linear_from_srgb(srgb8_from_linear(c) / 255.0); }));
  p.expression.reset();
  p.blendshapes.clear();
  p.uv = p.uv.cast<float>().cast<double>();
  const FaceContours contours = model.contours(level);
  p.regions["right_contour"] = contours.right;
  p.regions["left_contour"] = contours.left;
  return MorphableModel(std::move(p));
}

// Largest difference of two tables of numbers; infinity if they are not of one size.
template <class Table>
double difference(const Table& a, const Table& b) {
  if (a.rows() != b.rows()) return std::numeric_limits<double>::infinity();
  return a.size() > 0 ? static_cast<double>((a - b).cwiseAbs().maxCoeff()) : 0;
}

// The folder is read back: what it says must be what the model says, to the last bit of the files' precision, and the
// leading part of what the next finer level's folder says. Of the model itself, the levels are compared with all modes.
std::vector<ExportNesting> read_back(const MorphableModel& model, int level, const std::filesystem::path& folder) {
  const MorphableModel back = read_level_folder(folder);
  const Mesh mean = model.mean(level), obj = read_mesh(folder / "mean.obj");
  const auto row = [n = model.vertex_count(level)](const char* what, double deviation, const char* unit = "") {
    return NestingRow{n, n, what, deviation, 0, unit};
  };
  std::vector<ExportNesting> proof = {
      {"mean.ply and companions", compare_levels(back, as_in_files(model, level))},
      {"mean.obj",
       {row("positions", difference(obj.V, mean.V), "mm"), row("texture coordinates", difference(obj.uv, mean.uv)),
        row("triangles", difference(obj.F, mean.F))}}};
  proof[0].rows.push_back(row("triangles", difference(back.faces(), mean.F)));
  if (level + 1 == model.level_count()) return proof;
  proof.push_back({"mean.ply and companions", compare_levels(back, as_in_files(model, level + 1))});
  proof.push_back({"model", compare_levels(model.level(level), model.level(level + 1))});
  return proof;
}

void prove_nesting(const MorphableModel& model, int level, const std::filesystem::path& folder) {
  const std::vector<ExportNesting> proof = read_back(model, level, folder);
  write_file(folder / "nesting.json", nesting_json(proof));
  for (const ExportNesting& e : proof)
    for (const NestingRow& row : e.rows)
      if (!row.holds())
        throw SolverError("export: " + e.file + " of " + std::to_string(row.coarse) + " vertices in " +
                          folder.string() + (row.coarse == row.fine ? " is not the model's: " : " does not nest: ") +
                          row.quantity + " differ by " + std::to_string(row.deviation));
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
  // Files an earlier model left must not stand beside this one's.
  if (model.mirror().empty())
    std::filesystem::remove(folder / "symmetry.txt");
  else
    write_file(folder / "symmetry.txt", symmetry_text(model.mirror(), model.vertex_count(level)));
  if (model.parents().empty())
    std::filesystem::remove(folder / "parents.json");
  else
    write_file(folder / "parents.json", parents_json(model, level));
  prove_nesting(model, level, folder);
}

}  // namespace facewright
