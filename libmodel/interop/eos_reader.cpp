// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/eos_binary.h"
#include "libmodel/interop/eos_model.h"
#include "libmodel/interop/orthonormal_columns.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/model/surface_points.h"

namespace facewright {
namespace {

Faces read_triangles(ByteReader& in) {
  const auto count = in.value<std::uint64_t>();
  in.expect(count, 3 * sizeof(std::int32_t));
  Faces F(static_cast<Eigen::Index>(count), 3);
  in.array(F.data(), static_cast<size_t>(F.size()));
  return F;
}

std::string size_text(const Eigen::MatrixXf& m) { return std::to_string(m.rows()) + " x " + std::to_string(m.cols()); }

PcaModel read_pca(ByteReader& in, const std::string& part, Faces* F) {
  const Eigen::MatrixXf mean = read_eos_matrix(in, part + " mean"), basis = read_eos_matrix(in, part + " basis"),
                        variances = read_eos_matrix(in, part + " eigenvalues");
  if ((mean.cols() != 1 && mean.size() > 0) || mean.size() % 3 != 0)
    in.fail("has a " + part + " mean of " + size_text(mean) + "; expected 3 rows per vertex and one column");
  if (basis.cols() != variances.size() || (basis.cols() > 0 && basis.rows() != mean.size()))
    in.fail("has a " + part + " basis of " + size_text(basis) + "; expected " + std::to_string(mean.size()) + " x " +
            std::to_string(variances.size()) + " from mean and eigenvalues");
  for (Eigen::Index i = 0; i < variances.size(); ++i)
    if (variances(i) < 0 || (i > 0 && variances(i) > variances(i - 1)))
      in.fail("has " + part + " eigenvalue " + std::to_string(i + 1) +
              " negative or out of order; expected variances >= 0 in descending order");
  Faces triangles = read_triangles(in);
  for (Eigen::Index i = 0; i < triangles.size(); ++i)
    if (triangles.data()[i] < 0 || 3 * Eigen::Index{triangles.data()[i]} >= mean.size())
      in.fail("has a " + part + " triangle at vertex " + std::to_string(triangles.data()[i]) + " of " +
              std::to_string(mean.size() / 3) + ", counted from 0");
  if (F != nullptr) *F = std::move(triangles);
  return {Eigen::Map<const Eigen::VectorXf>(mean.data(), mean.size()).cast<double>(), basis.cast<double>(),
          Eigen::Map<const Eigen::VectorXf>(variances.data(), variances.size()).cast<double>(),
          has_orthonormal_columns(basis)};
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

// Coordinates of the texture's own triangles, where every vertex has one place only.
TexCoords uv_of_vertices(const ByteReader& in, const TexCoords& uv, const Faces& own, const Faces& F,
                         Eigen::Index vertices) {
  if (own.rows() != F.rows())
    in.fail("has " + std::to_string(own.rows()) + " texture triangles for " + std::to_string(F.rows()) + " triangles");
  TexCoords result = TexCoords::Zero(vertices, 2);
  std::vector<int> place(static_cast<size_t>(vertices), -1);
  for (Eigen::Index i = 0; i < F.size(); ++i) {
    const int t = own.data()[i];
    int& known = place[static_cast<size_t>(F.data()[i])];
    if (t < 0 || t >= uv.rows()) in.fail("has a texture triangle without coordinates");
    if (known >= 0 && uv.row(known) != uv.row(t))
      in.fail("has texture coordinates per triangle corner, with a seam at vertex " + std::to_string(F.data()[i]) +
              "; only those per vertex can be read");
    known = t;
    result.row(F.data()[i]) = uv.row(t);
  }
  return result;
}

}  // namespace

MorphableModel read_eos_model(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  ByteReader in(bytes, path.string());
  const auto version = in.value<std::uint32_t>();
  if (version < 1 || version > 4) in.fail("has class version " + std::to_string(version) + "; known are 1 to 4");
  MorphableModelParts p;
  Faces F;
  p.shape = read_pca(in, "shape", &F);
  p.colour = read_pca(in, "colour", nullptr);
  if (version >= 2 && in.value<std::uint8_t>() == 0) {
    const auto kind = in.value<std::int32_t>();
    if (kind != kEosPcaExpressions && kind != kEosBlendshapes)
      in.fail("has an expression model of kind " + std::to_string(kind) + "; known are 0, PCA, and 1, blendshapes");
    if (kind == kEosPcaExpressions) p.expression = read_pca(in, "expression", nullptr);
    if (kind == kEosBlendshapes) p.blendshapes = read_eos_blendshape_list(in);
  }
  if (version >= 3 && in.value<std::uint8_t>() == 0) p.landmarks = read_landmark_table(in);
  p.uv = read_uv(in);
  if (version >= 4)
    if (const Faces own = read_triangles(in); own.rows() > 0)
      p.uv = uv_of_vertices(in, p.uv, own, F, p.shape.vertex_count());
  if (!in.at_end()) in.fail("goes on after the end of the model");
  for (auto& [name, mark] : p.landmarks) mark.point = point_at_vertex(F, mark.vertex);
  p.levels = {{static_cast<int>(p.shape.vertex_count()), std::move(F)}};
  try {
    return MorphableModel(std::move(p), MorphableModel::ValidStatistics{});
  } catch (const InvalidInput& error) {
    in.fail(error.what());
  }
}

}  // namespace facewright
