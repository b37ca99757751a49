// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/npz.h"

#include "libmodel/core/errors.h"
#include "libmodel/interop/npy.h"
#include "libmodel/interop/orthonormal_columns.h"
#include "libmodel/interop/zip_archive.h"
#include "libmodel/model/surface_points.h"

namespace facewright {
namespace {

void add_pca(ZipWriter& zip, const std::string& name, const PcaModel& pca) {
  zip.add(name + "_mean.npy", npy_bytes(NpyMatrix<float>(as_vertices(pca.mean).cast<float>())));
  zip.add(name + "_basis.npy", npy_bytes(NpyMatrix<float>(pca.basis.cast<float>())));
  zip.add(name + "_variances.npy", npy_bytes(NpyMatrix<float>(pca.variances.cast<float>()), true));
}

void add_blendshapes(ZipWriter& zip, const std::vector<Blendshape>& blendshapes) {
  if (blendshapes.empty()) return;
  NpyMatrix<float> steps(blendshapes.front().displacement.size(), static_cast<Eigen::Index>(blendshapes.size()));
  std::vector<std::string> names;
  for (const Blendshape& b : blendshapes) {
    steps.col(static_cast<Eigen::Index>(names.size())) = b.displacement.cast<float>();
    names.push_back(b.name);
  }
  zip.add("blendshapes.npy", npy_bytes(steps));
  zip.add("blendshape_names.npy", npy_bytes(names));
}

PcaModel read_pca(const NpzArchive& archive, const std::string& name) {
  PcaModel result;
  result.mean = as_vector(Vertices(archive.real(name + "_mean", 3)));
  result.basis = archive.real(name + "_basis");
  result.variances = archive.real(name + "_variances", 1);
  result.orthonormal = has_orthonormal_columns(result.basis);
  return result;
}

LandmarkSet read_marks(const NpzArchive& archive, const Faces& F) {
  LandmarkSet marks;
  const auto vertices = archive.whole("landmark_vertices", 1);
  const std::vector<std::string> names = archive.names("landmark_names");
  if (static_cast<Eigen::Index>(names.size()) != vertices.size())
    archive.fail("landmark_names",
                 "has " + std::to_string(names.size()) + " names for " + std::to_string(vertices.size()) + " vertices");
  for (size_t i = 0; i < names.size(); ++i) {
    const int v = vertices(static_cast<Eigen::Index>(i));
    marks[names[i]] = {point_at_vertex(F, v), v};
  }
  return marks;
}

std::vector<Blendshape> read_blendshapes(const NpzArchive& archive) {
  std::vector<Blendshape> blendshapes;
  if (!archive.has("blendshapes")) return blendshapes;
  const std::vector<std::string> names = archive.names("blendshape_names");
  const NpyMatrix<double> steps = archive.real("blendshapes", static_cast<Eigen::Index>(names.size()));
  for (size_t i = 0; i < names.size(); ++i) blendshapes.push_back({names[i], steps.col(static_cast<Eigen::Index>(i))});
  return blendshapes;
}

}  // namespace

std::string npz_bytes(const MorphableModel& model) {
  if (model.level_count() != 1) throw InvalidInput("npz: a file holds one level; choose one");
  ZipWriter zip;
  add_pca(zip, "shape", model.shape());
  if (model.has_colour()) add_pca(zip, "colour", model.colour());
  if (model.expression()) add_pca(zip, "expression", *model.expression());
  add_blendshapes(zip, model.blendshapes());
  zip.add("faces.npy", npy_bytes(NpyMatrix<std::int32_t>(model.faces())));
  if (model.uv().rows() > 0) zip.add("uv.npy", npy_bytes(NpyMatrix<double>(model.uv())));
  if (!model.mirror().empty())
    zip.add("mirror.npy", npy_bytes(NpyMatrix<std::int32_t>(
                                        Eigen::Map<const Eigen::VectorXi>(model.mirror().data(), model.vertex_count())),
                                    true));
  NpyMatrix<std::int32_t> vertices(static_cast<Eigen::Index>(model.landmarks().size()), 1);
  std::vector<std::string> names;
  for (const auto& [name, mark] : model.landmarks()) {
    vertices(static_cast<Eigen::Index>(names.size()), 0) = mark.vertex;
    names.push_back(name);
  }
  zip.add("landmark_vertices.npy", npy_bytes(vertices, true));
  zip.add("landmark_names.npy", npy_bytes(names));
  return zip.finish();
}

MorphableModel read_npz_model(const std::filesystem::path& path) {
  const NpzArchive archive(path);
  MorphableModelParts p;
  p.shape = read_pca(archive, "shape");
  if (archive.has("colour_mean")) p.colour = read_pca(archive, "colour");
  if (archive.has("expression_mean")) p.expression = read_pca(archive, "expression");
  p.blendshapes = read_blendshapes(archive);
  const Faces F = archive.whole("faces", 3);
  p.landmarks = read_marks(archive, F);
  if (archive.has("uv")) p.uv = archive.real("uv", 2);
  if (archive.has("mirror")) {
    const auto mirror = archive.whole("mirror", 1);
    p.mirror.assign(mirror.data(), mirror.data() + mirror.size());
  }
  p.levels = {{static_cast<int>(p.shape.vertex_count()), F}};
  try {
    return MorphableModel(std::move(p));
  } catch (const InvalidInput& error) {
    throw IoError(path.string(), error.what());
  }
}

}  // namespace facewright
