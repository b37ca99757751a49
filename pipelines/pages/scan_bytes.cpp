// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/pages/scan_bytes.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "libmodel/core/image.h"

namespace facewright {
namespace {

using Floats = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Rows of the mesh's vertices and texture coordinates that make the page's vertices, and its triangles.
struct Corners {
  std::vector<int> vertex, uv;
  Eigen::Matrix<std::uint32_t, Eigen::Dynamic, 3, Eigen::RowMajor> F;
};

Corners corners_of(const Mesh& mesh) {
  Corners c;
  c.F.resize(mesh.F.rows(), 3);
  if (mesh.uv_faces.rows() == 0) {
    c.F = mesh.F.cast<std::uint32_t>();
    for (int v = 0; v < mesh.V.rows(); ++v) c.vertex.push_back(v);
    c.uv = c.vertex;
    return c;
  }
  std::unordered_map<std::uint64_t, std::uint32_t> known;
  for (Eigen::Index i = 0; i < mesh.F.size(); ++i) {
    const int v = mesh.F.data()[i], t = mesh.uv_faces.data()[i];
    const std::uint64_t key = static_cast<std::uint64_t>(v) << 32 | static_cast<std::uint32_t>(t);
    const auto [at, is_new] = known.try_emplace(key, static_cast<std::uint32_t>(c.vertex.size()));
    if (is_new) c.vertex.push_back(v), c.uv.push_back(t);
    c.F.data()[i] = at->second;
  }
  return c;
}

template <class Matrix>
void append(std::string& bytes, const Matrix& m) {
  bytes.append(reinterpret_cast<const char*>(m.data()), static_cast<size_t>(m.size()) * sizeof(*m.data()));
}

}  // namespace

ScanBytes scan_bytes(const Mesh& mesh) {
  const Corners c = corners_of(mesh);
  ScanBytes result;
  result.vertices = static_cast<Eigen::Index>(c.vertex.size());
  result.triangles = mesh.F.rows();
  result.has_colours = mesh.has_colours();
  result.has_uv = mesh.has_uv();
  result.centre = (mesh.V.colwise().minCoeff() + mesh.V.colwise().maxCoeff()).transpose() / 2;
  const Vertices moved = mesh.V(c.vertex, Eigen::all).rowwise() - result.centre.transpose();
  append(result.bytes, Floats(moved.cast<float>()));
  append(result.bytes, c.F);
  if (result.has_colours)
    for (const int v : c.vertex)
      for (int k = 0; k < 3; ++k) result.bytes += static_cast<char>(srgb8_from_linear(mesh.colours(v, k)));
  // A float32 array of the page must begin at a multiple of four.
  result.bytes.resize((result.bytes.size() + 3) / 4 * 4, '\0');
  if (result.has_uv) append(result.bytes, Floats(mesh.uv(c.uv, Eigen::all).cast<float>()));
  return result;
}

}  // namespace facewright
