// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/flame_npz.h"

#include "libmodel/core/errors.h"
#include "libmodel/interop/foreign_model.h"
#include "libmodel/interop/npy.h"
#include "libmodel/interop/zip_archive.h"

namespace facewright {
namespace {

constexpr double kMetresPerMillimetre = 1e-3;
constexpr int kFlameIdentity = 300, kFlameAll = 400;  // columns of the published models

struct Direction {
  std::string name;
  Eigen::VectorXd step;
};

void add_modes(std::vector<Direction>& directions, const std::string& name, const PcaModel& pca) {
  for (Eigen::Index k = 0; k < pca.mode_count(); ++k)
    directions.push_back({name + " " + std::to_string(k + 1), std::sqrt(pca.variances[k]) * pca.basis.col(k)});
}

std::vector<Direction> directions_of(const MorphableModel& model) {
  std::vector<Direction> directions;
  add_modes(directions, "shape", model.shape());
  if (model.expression()) {
    if (!model.expression()->mean.isZero(0)) directions.push_back({"expression mean", model.expression()->mean});
    add_modes(directions, "expression", *model.expression());
  }
  for (const Blendshape& b : model.blendshapes()) directions.push_back({"blendshape " + b.name, b.displacement});
  return directions;
}

NpyMatrix<float> metres(const Eigen::MatrixXd& m) { return (kMetresPerMillimetre * m).cast<float>(); }

// Columns after the identity's, by their names; without names all are modes of expression.
void take_expressions(ForeignModel& model, const Eigen::MatrixXd& columns, const std::vector<std::string>& names,
                      Eigen::Index identity) {
  ForeignModes e;
  e.mean = Eigen::VectorXd::Zero(columns.rows());
  e.scale = ModeScale::columns;
  std::vector<Eigen::Index> modes;
  bool any = false;
  for (Eigen::Index k = identity; k < columns.cols(); ++k) {
    const std::string name = names.empty() ? "expression" : names[static_cast<size_t>(k)];
    if (name.starts_with("blendshape ")) {
      model.blendshapes.push_back({name.substr(11), columns.col(k)});
      continue;
    }
    any = true;
    if (name == "expression mean")
      e.mean = columns.col(k);
    else
      modes.push_back(k);
  }
  if (!any) return;
  e.columns = columns(Eigen::all, modes);
  model.expression = std::move(e);
}

void take_landmarks(const NpzArchive& archive, ForeignModel& model) {
  if (!archive.has("landmark_vertices") || !archive.has("landmark_names")) return;
  const auto vertices = archive.whole("landmark_vertices", 1);
  const auto names = archive.names("landmark_names");
  if (static_cast<Eigen::Index>(names.size()) != vertices.size())
    archive.fail("landmark_names", "does not have one name per landmark vertex");
  for (size_t i = 0; i < names.size(); ++i) model.landmarks[names[i]] = vertices(static_cast<Eigen::Index>(i));
}

}  // namespace

std::string flame_npz_bytes(const MorphableModel& model) {
  if (model.level_count() != 1) throw InvalidInput("flame: a file holds one level; choose one");
  const std::vector<Direction> directions = directions_of(model);
  const auto k = static_cast<Eigen::Index>(directions.size());
  NpyMatrix<float> dirs(model.shape().mean.size(), k);
  std::vector<std::string> names;
  for (const Direction& d : directions) {
    dirs.col(static_cast<Eigen::Index>(names.size())) = (kMetresPerMillimetre * d.step).cast<float>();
    names.push_back(d.name);
  }
  ZipWriter zip;
  zip.add("v_template.npy", npy_bytes(metres(as_vertices(model.shape().mean))));
  zip.add("shapedirs.npy",
          npy_bytes("<f4", std::to_string(model.vertex_count()) + ",3," + std::to_string(k),
                    std::string(reinterpret_cast<const char*>(dirs.data()), static_cast<size_t>(dirs.size()) * 4)));
  zip.add("f.npy", npy_bytes(NpyMatrix<std::int32_t>(model.faces())));
  zip.add("dir_names.npy", npy_bytes(names));
  zip.add("identity_count.npy", npy_bytes(NpyMatrix<std::int32_t>(NpyMatrix<std::int32_t>::Constant(
                                              1, 1, static_cast<int>(model.shape().mode_count()))),
                                          true));
  if (model.uv().rows() > 0) zip.add("texcoords.npy", npy_bytes(NpyMatrix<double>(model.uv())));
  NpyMatrix<std::int32_t> vertices(static_cast<Eigen::Index>(model.landmarks().size()), 1);
  std::vector<std::string> marks;
  for (const auto& [name, mark] : model.landmarks()) {
    vertices(static_cast<Eigen::Index>(marks.size()), 0) = mark.vertex;
    marks.push_back(name);
  }
  zip.add("landmark_vertices.npy", npy_bytes(vertices, true));
  zip.add("landmark_names.npy", npy_bytes(marks));
  return zip.finish();
}

ForeignModel read_flame(const std::filesystem::path& path, int identity_modes) {
  const NpzArchive archive(path);
  ForeignModel model;
  model.path = path.string();
  model.format = "FLAME-style archive (.npz)";
  const Vertices mean = archive.real("v_template", 3);
  model.shape.mean = as_vector(mean);
  if (mean.rows() == 0) archive.fail("v_template", "has no vertices");
  const NpyArray& dirs = archive.at("shapedirs");
  if (dirs.shape.size() != 3 || dirs.shape[1] != 3 || dirs.shape[0] != static_cast<std::uint64_t>(mean.rows()))
    archive.fail("shapedirs", "is not (" + std::to_string(mean.rows()) + ", 3, K) as v_template demands");
  const Eigen::MatrixXd columns = archive.real("shapedirs");
  std::vector<std::string> names;
  if (archive.has("dir_names")) names = archive.names("dir_names");
  if (!names.empty() && static_cast<Eigen::Index>(names.size()) != columns.cols())
    archive.fail("dir_names", "does not have one name per column of shapedirs");
  Eigen::Index identity = columns.cols();
  std::string why = "all columns of shapedirs";
  if (identity_modes >= 0) {
    identity = identity_modes;
    why = "as asked";
  } else if (archive.has("identity_count")) {
    const auto count = archive.whole("identity_count", 1);
    if (count.size() != 1) archive.fail("identity_count", "is not one number");
    identity = count(0, 0);
    why = "as identity_count says";
  } else if (columns.cols() == kFlameAll) {
    identity = kFlameIdentity;
    why = "of 400, FLAME's division";
  }
  if (identity < 0 || identity > columns.cols())
    archive.fail("shapedirs", "has " + std::to_string(columns.cols()) + " columns, not " + std::to_string(identity) +
                                  " of identity; choose with --identity-modes");
  model.notes.push_back("modes: the first " + std::to_string(identity) + " columns are identity (" + why +
                        "), the rest expression");
  model.shape.columns = columns.leftCols(identity);
  model.shape.scale = ModeScale::columns;
  take_expressions(model, columns, names, identity);
  model.F = zero_based(archive.whole("f", 3), static_cast<int>(mean.rows()), 0, model);
  if (archive.has("texcoords")) model.uv = archive.real("texcoords", 2);
  if (model.uv.rows() != 0 && model.uv.rows() != mean.rows())
    archive.fail("texcoords",
                 "has " + std::to_string(model.uv.rows()) + " rows for " + std::to_string(mean.rows()) + " vertices");
  take_landmarks(archive, model);
  for (const char* name : {"posedirs", "J_regressor", "weights", "lbs_weights", "kintree_table"})
    if (archive.has(name)) model.notes.push_back(std::string("left out: ") + name + " (poses of the jaw and the neck)");
  model.units = "m";
  return model;
}

}  // namespace facewright
