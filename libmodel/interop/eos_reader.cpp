// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/byte_reader.h"
#include "libmodel/interop/eos_model.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/model/surface_points.h"

namespace facewright {
namespace {

Eigen::MatrixXd read_matrix(ByteReader& in) {
  const auto rows = in.value<std::int32_t>(), cols = in.value<std::int32_t>();
  if (rows < 0 || cols < 0) in.fail("has a matrix of negative size");
  in.expect(static_cast<size_t>(rows) * static_cast<size_t>(cols), sizeof(float));
  Eigen::MatrixXf m(rows, cols);
  in.array(m.data(), static_cast<size_t>(m.size()));
  return m.cast<double>();
}

Faces read_triangles(ByteReader& in) {
  const auto count = in.value<std::uint64_t>();
  in.expect(count, 3 * sizeof(std::int32_t));
  Faces F(static_cast<Eigen::Index>(count), 3);
  in.array(F.data(), static_cast<size_t>(F.size()));
  return F;
}

PcaModel read_pca(ByteReader& in, Faces* F) {
  PcaModel pca;
  const Eigen::MatrixXd mean = read_matrix(in);
  pca.mean = Eigen::Map<const Eigen::VectorXd>(mean.data(), mean.size());
  pca.basis = read_matrix(in);
  const Eigen::MatrixXd variances = read_matrix(in);
  pca.variances = Eigen::Map<const Eigen::VectorXd>(variances.data(), variances.size());
  Faces triangles = read_triangles(in);
  if (F != nullptr) *F = std::move(triangles);
  return pca;
}

LandmarkSet read_landmark_table(ByteReader& in) {
  LandmarkSet marks;
  for (auto n = in.value<std::uint64_t>(); n > 0; --n) {
    const std::string name = in.text(in.value<std::uint64_t>());
    marks[name].vertex = in.value<std::int32_t>();
  }
  return marks;
}

TexCoords read_uv(ByteReader& in) {
  const auto count = in.value<std::uint64_t>();
  in.expect(count, 2 * sizeof(double));
  TexCoords uv(static_cast<Eigen::Index>(count), 2);
  in.array(uv.data(), static_cast<size_t>(uv.size()));
  uv.col(1) = 1 - uv.col(1).array();
  return uv;
}

}  // namespace

MorphableModel read_eos_model(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  ByteReader in(bytes, path.string());
  const auto version = in.value<std::uint32_t>();
  if (version < 1 || version > 4) in.fail("has class version " + std::to_string(version) + "; known are 1 to 4");
  MorphableModelParts p;
  Faces F;
  p.shape = read_pca(in, &F);
  p.colour = read_pca(in, nullptr);
  if (version >= 2 && in.value<std::uint8_t>() == 0) {
    if (in.value<std::int32_t>() != 0) in.fail("has blendshapes; only expression models by PCA can be read");
    p.expression = read_pca(in, nullptr);
  }
  if (version >= 3 && in.value<std::uint8_t>() == 0) p.landmarks = read_landmark_table(in);
  p.uv = read_uv(in);
  if (version >= 4)
    if (const Faces own = read_triangles(in); own.rows() > 0 && (own.rows() != F.rows() || own != F))
      in.fail("has texture coordinates per triangle corner; only those per vertex can be read");
  if (!in.at_end()) in.fail("goes on after the end of the model");
  for (auto& [name, mark] : p.landmarks) mark.point = point_at_vertex(F, mark.vertex);
  p.levels = {{static_cast<int>(p.shape.vertex_count()), std::move(F)}};
  try {
    return MorphableModel(std::move(p));
  } catch (const InvalidInput& error) {
    in.fail(error.what());
  }
}

}  // namespace facewright
