// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <nlohmann/json.hpp>

#include "libmodel/io/atomic_file.h"
#include "libmodel/model/hdf5_archive.h"
#include "libmodel/model/model_file.h"
#include "libmodel/model/representer_reader.h"

namespace facewright {
namespace {

using nlohmann::json;

const char* const kTool = "Facewright";

/// What a level's statismo models hold.
enum class LevelBasis {
  shared,  ///< the model's own basis: the finest level
  own      ///< an orthonormal one in place of cut rows, with the map to the shared coefficients
};

void write_version(Hdf5Writer& h5, const std::string& at) {
  h5.scalar(at + "/version/majorVersion", 0);
  h5.scalar(at + "/version/minorVersion", 9);
}

std::string build_time(const MorphableModel& model) {
  const auto entry = model.provenance().find("build_time");
  return entry == model.provenance().end() ? "" : entry->second;
}

// Readers forbid empty matrices: a model without modes is written with one mode of no variance.
void write_statistics(Hdf5Writer& h5, const std::string& at, const PcaModel& pca) {
  h5.vector(at + "/mean", pca.mean.cast<float>());
  const bool none = pca.mode_count() == 0;
  h5.matrix(at + "/pcaBasis", none ? RowMatrixXf::Zero(pca.mean.size(), 1) : RowMatrixXf(pca.basis.cast<float>()));
  h5.vector(at + "/pcaVariance", none ? Eigen::VectorXf::Zero(1) : Eigen::VectorXf(pca.variances.cast<float>()));
  h5.vector(at + "/noiseVariance", Eigen::VectorXf::Zero(1));
}

void write_model_info(Hdf5Writer& h5, const std::string& at, const MorphableModel& model) {
  h5.string(at + "/build-time", build_time(model));
  h5.matrix(at + "/scores", RowMatrixXf(RowMatrixXf::Zero(1, 1)));
  const std::string builder = at + "/modelBuilder-0";
  h5.string(builder + "/builderName", kTool);
  h5.string(builder + "/buildTime", build_time(model));
  h5.group(builder + "/dataInfo");
  h5.group(builder + "/parameters");
  for (const auto& [key, value] : model.provenance()) h5.string(builder + "/parameters/" + key, value);
}

void write_representer(Hdf5Writer& h5, const std::string& at, const std::string& name, const std::string& type) {
  h5.attribute(at, "name", name);
  h5.attribute(at, "datasetType", type);
  h5.attribute(at, "version", "0.1");
}

// Part "shape", "color" or "expression" of the level at `at`. Rows cut off an orthonormal basis become one of their
// own.
void write_submodel(Hdf5Writer& h5, const std::string& at, const std::string& part, const PcaModel& pca,
                    const MorphableModel& model, LevelBasis basis) {
  const std::string group = at + "/" + part;
  if (basis == LevelBasis::own && pca.mode_count() > 0) {
    const OrthonormalLevel level = orthonormal_level(pca);
    write_statistics(h5, group + "/model", level.model);
    h5.matrix(at + "/metadata/ext/shared_from_own/" + part, RowMatrixXd(level.own_from_shared.transpose()));
  } else {
    write_statistics(h5, group + "/model", pca);
  }
  write_model_info(h5, group + "/modelinfo", model);
  write_version(h5, group);
}

void write_catalogue_entry(Hdf5Writer& h5, const std::string& at, const std::string& path, const std::string& type) {
  h5.string(at + "/modelPath", path);
  h5.string(at + "/modelType", type);
}

void write_catalogue(Hdf5Writer& h5, const std::string& at, const MorphableModel& model) {
  const std::string list = at + "/catalog/MorphableModel";
  write_catalogue_entry(h5, list, at.empty() ? "/" : at, "CUSTOM_MODEL");
  write_catalogue_entry(h5, list + ".shape", at + "/shape", "POLYGON_MESH_MODEL");
  if (model.has_colour()) write_catalogue_entry(h5, list + ".color", at + "/color", "POLYGON_MESH_DATA_MODEL");
  if (model.expression())
    write_catalogue_entry(h5, list + ".expression", at + "/expression", "POLYGON_MESH_DATA_MODEL");
}

std::string landmark_json(const MorphableModel& model) {
  json list = json::array();
  const Vertices stored = as_vertices(model.shape().mean).cast<float>().cast<double>();
  for (const auto& [name, mark] : locate(model.landmarks(0), stored, model.faces())) {
    const Eigen::Vector3f x = mark.position.cast<float>();
    list.push_back({{"id", name}, {"coordinates", {x[0], x[1], x[2]}}});
  }
  return list.dump();
}

std::string landmark_vertex_json(const MorphableModel& model) {
  json table = json::object();
  for (const auto& [name, mark] : model.landmarks()) table[name] = mark.vertex;
  return table.dump();
}

std::string landmark_point_json(const MorphableModel& model) {
  json table = json::object();
  for (const auto& [name, mark] : model.landmarks(0)) {
    const Eigen::Vector3d& b = mark.point.barycentric;
    table[name] = {{"triangle", mark.point.triangle}, {"barycentric", {b[0], b[1], b[2]}}, {"vertex", mark.vertex}};
  }
  return table.dump();
}

std::string contour_json(const MorphableModel& model) {
  const FaceContours contours = model.contours();
  return json{{"right", contours.right}, {"left", contours.left}}.dump();
}

RowMatrixXi edge_table(const MorphableModel& model) {
  const std::vector<Edge> all = model.edge_topology();
  RowMatrixXi table(static_cast<Eigen::Index>(all.size()), 4);
  for (size_t i = 0; i < all.size(); ++i)
    table.row(static_cast<Eigen::Index>(i)) << all[i].v0, all[i].v1, all[i].f0, all[i].f1;
  return table;
}

RowMatrixXi parent_table(const std::vector<VertexParents>& parents) {
  RowMatrixXi table(static_cast<Eigen::Index>(parents.size()), 3);
  for (size_t i = 0; i < parents.size(); ++i)
    table.row(static_cast<Eigen::Index>(i)) << parents[i].a, parents[i].b, parents[i].c;
  return table;
}

void write_blendshapes(Hdf5Writer& h5, const std::string& at, const MorphableModel& model) {
  const std::vector<Blendshape>& all = model.blendshapes();
  if (all.empty()) return;
  json names = json::array();
  RowMatrixXf rows(static_cast<Eigen::Index>(all.size()), model.shape().mean.size());
  for (size_t i = 0; i < all.size(); ++i) {
    names.push_back(all[i].name);
    rows.row(static_cast<Eigen::Index>(i)) = all[i].displacement.cast<float>();
  }
  h5.string(at + "/names", names.dump());
  h5.matrix(at + "/displacements", rows);
}

// What statismo has no place for.
void write_extension(Hdf5Writer& h5, const std::string& at, const MorphableModel& model, LevelBasis basis) {
  h5.string(at + "/format", "facewright-model 3");
  const bool orthonormal = model.shape().orthonormal && (!model.has_colour() || model.colour().orthonormal) &&
                           (!model.expression() || model.expression()->orthonormal);
  h5.string(at + "/basis", basis == LevelBasis::own || orthonormal ? "orthonormal" : "row-truncated");
  h5.string(at + "/length_unit", kLengthUnit);
  h5.string(at + "/axes", kAxes);
  h5.string(at + "/winding", kWinding);
  write_blendshapes(h5, at + "/blendshapes", model);
  h5.string(at + "/colourspace", "linear RGB, sRGB primaries");
  h5.string(at + "/landmark_vertices", landmark_vertex_json(model));
  h5.string(at + "/landmark_points", landmark_point_json(model));
  h5.string(at + "/contours", contour_json(model));
  h5.string(at + "/regions", json(model.regions()).dump());
  h5.string(at + "/provenance", json(model.provenance()).dump(-1, ' ', false, json::error_handler_t::replace));
  if (model.uv().rows() > 0) h5.matrix(at + "/uv", RowMatrixXd(model.uv()));
  if (!model.mirror().empty()) h5.vector(at + "/mirror", model.mirror());
  if (!model.parents().empty()) h5.matrix(at + "/parents", parent_table(model.parents()));
  if (model.base_faces().rows() > 0) h5.matrix(at + "/base_faces", RowMatrixXi(model.base_faces()));
  if (model.faces().rows() > 0) h5.matrix(at + "/edges", edge_table(model));
}

// One level as a morphable model of its own.
void write_level(Hdf5Writer& h5, const std::string& at, const MorphableModel& model, LevelBasis basis) {
  const std::string representer = at + "/shape/representer";
  h5.matrix(representer + "/points", RowMatrixXf(as_vertices(model.shape().mean).transpose().cast<float>()));
  h5.matrix(representer + "/cells", RowMatrixXi(model.faces().transpose()));
  write_representer(h5, representer, "gravis::MeshShapeRepresenter", "POLYGON_MESH");
  write_submodel(h5, at, "shape", model.shape(), model, basis);
  const auto write_data = [&](const std::string& name, const std::string& representer_name, const PcaModel& pca) {
    const std::string own = at + "/" + name + "/representer";
    for (const char* dataset : {"/points", "/cells"}) h5.link(own + dataset, representer + dataset);
    write_representer(h5, own, representer_name, "POLYGON_MESH_DATA");
    write_submodel(h5, at, name, pca, model, basis);
  };
  if (model.has_colour()) {
    write_data("color", "gravis::MeshColorRepresenter", model.colour());
    h5.string(at + "/color/representer/colorspace", "RGB");
  }
  if (model.expression()) write_data("expression", "gravis::MeshExpressionRepresenter", *model.expression());
  write_version(h5, at);
  write_catalogue(h5, at, model);
  h5.string(at + "/metadata/landmarks/json", landmark_json(model));
  write_extension(h5, at + "/metadata/ext", model, basis);
}

std::string level_path(int l) { return "/level" + std::to_string(l); }

PcaModel rounded(const PcaModel& pca) {
  return {pca.mean.cast<float>().cast<double>(), pca.basis.cast<float>().cast<double>(),
          pca.variances.cast<float>().cast<double>(), pca.orthonormal};
}

// The numbers as the file keeps them, so that what follows from them, the levels' own bases, is the same when a loaded
// model is saved.
MorphableModel rounded(const MorphableModel& model) {
  MorphableModelParts parts = model.parts();
  parts.shape = rounded(parts.shape);
  parts.colour = rounded(parts.colour);
  if (parts.expression) parts.expression = rounded(*parts.expression);
  return MorphableModel(std::move(parts));
}

}  // namespace

std::string serialise_model(const MorphableModel& given) {
  const MorphableModel model = rounded(given);
  Hdf5Writer h5;
  RowMatrixXi table(model.level_count(), 2);
  for (int l = 0; l < model.level_count(); ++l) {
    const bool is_cut = l + 1 < model.level_count() && model.shape().orthonormal;
    write_level(h5, level_path(l), model.level(l), is_cut ? LevelBasis::own : LevelBasis::shared);
    table.row(l) << model.vertex_count(l), static_cast<int>(model.faces(l).rows());
  }
  const std::string finest = level_path(model.level_count() - 1);
  for (const char* part : {"/shape", "/color", "/expression", "/metadata"})
    if ((part != std::string("/color") || model.has_colour()) &&
        (part != std::string("/expression") || model.expression()))
      h5.link(part, finest + part);
  write_version(h5, "");
  write_catalogue(h5, "", model);
  h5.matrix("/levels", table);
  return h5.bytes();
}

void save_model(const std::filesystem::path& path, const MorphableModel& model) {
  write_file(path, serialise_model(model));
}

}  // namespace facewright
