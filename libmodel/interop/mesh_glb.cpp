// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/mesh_glb.h"

#include <algorithm>
#include <map>

#include "libmodel/interop/gltf_scene.h"
#include "libmodel/io/image_files.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;

// One texture coordinate per vertex: vertices with several are repeated. `normals` follow.
Mesh with_vertex_uv(const Mesh& mesh, Vertices& normals) {
  if (mesh.uv_faces.rows() == 0) return mesh;
  std::map<std::pair<int, int>, int> index;
  std::vector<std::pair<int, int>> corners;
  Mesh split;
  split.F.resize(mesh.F.rows(), 3);
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      const std::pair corner(mesh.F(f, k), mesh.uv_faces(f, k));
      const auto [entry, is_new] = index.try_emplace(corner, static_cast<int>(corners.size()));
      if (is_new) corners.push_back(corner);
      split.F(f, k) = entry->second;
    }
  const auto n = static_cast<Eigen::Index>(corners.size());
  Vertices split_normals(n, 3);
  split.V.resize(n, 3);
  split.uv.resize(n, 2);
  if (mesh.has_colours()) split.colours.resize(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto [v, t] = corners[static_cast<size_t>(i)];
    split.V.row(i) = mesh.V.row(v);
    split.uv.row(i) = mesh.uv.row(t);
    split_normals.row(i) = normals.row(v);
    if (mesh.has_colours()) split.colours.row(i) = mesh.colours.row(v);
  }
  normals = split_normals;
  return split;
}

Image opaque(const Image& image) {
  if (image.channels != 4) return image;
  Image rgb(image.width, image.height, 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) std::copy_n(image.pixel(x, y), 3, rgb.pixel(x, y));
  return rgb;
}

}  // namespace

std::string mesh_glb_bytes(const Mesh& mesh, const Image& texture) {
  validate(mesh);
  Vertices normals = unit_vertex_normals(mesh.V, mesh.F);
  const bool textured = !texture.empty() && mesh.has_uv();
  const Mesh shown = textured ? with_vertex_uv(mesh, normals) : mesh;
  GltfBuffer buffer;
  Json gltf = gltf_scene("face"), attributes;
  attributes["POSITION"] = buffer.add(gltf_positions(shown.V), true);
  attributes["NORMAL"] = buffer.add(normals.cast<float>(), false);
  Json material = gltf_skin();
  if (textured) {
    attributes["TEXCOORD_0"] = buffer.add(gltf_coordinates(shown.uv), false);
    add_gltf_texture(gltf, material, buffer.add_bytes(png_bytes(opaque(texture))), "texture");
  } else if (shown.has_colours()) {
    attributes["COLOR_0"] = buffer.add(shown.colours.cast<float>(), false);
  }
  const int indices = buffer.add(shown.F);
  const Json primitive = {{"attributes", attributes}, {"indices", indices}, {"material", 0}};
  gltf["materials"] = Json::array({material});
  gltf["meshes"] = Json::array({{{"name", "face"}, {"primitives", Json::array({primitive})}}});
  return buffer.file(std::move(gltf));
}

}  // namespace facewright
