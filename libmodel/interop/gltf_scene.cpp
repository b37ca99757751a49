// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/gltf_scene.h"

#include "libmodel/geometry/normals.h"

namespace facewright {

using Json = GltfBuffer::Json;

Json gltf_scene(const std::string& name) {
  return {{"asset", {{"version", "2.0"}, {"generator", "Facewright"}}},
          {"scene", 0},
          {"scenes", Json::array({{{"nodes", Json::array({0})}}})},
          {"nodes", Json::array({{{"mesh", 0}, {"name", name}}})}};
}

Json gltf_skin() {
  return {{"name", "skin"},
          {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 0.9}}},
          {"doubleSided", true}};
}

void add_gltf_texture(Json& gltf, Json& material, int image_view, const std::string& name) {
  gltf["images"] = Json::array({{{"name", name}, {"mimeType", "image/png"}, {"bufferView", image_view}}});
  gltf["samplers"] = Json::array({{{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 33071}, {"wrapT", 33071}}});
  gltf["textures"] = Json::array({{{"source", 0}, {"sampler", 0}}});
  material["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
}

GltfBuffer::RowMatrixXf gltf_positions(const Vertices& V) {
  constexpr double metres_per_millimetre = 1e-3;
  return (V * metres_per_millimetre).cast<float>();
}

GltfBuffer::RowMatrixXf gltf_coordinates(TexCoords uv) {
  uv.col(1) = 1 - uv.col(1).array();
  return uv.cast<float>();
}

Vertices unit_vertex_normals(const Vertices& V, const Faces& F) {
  Vertices N = vertex_normals(V, F);
  for (Eigen::Index v = 0; v < N.rows(); ++v)
    if (N.row(v).squaredNorm() < 0.5) N.row(v) << 0, 0, 1;
  return N;
}

}  // namespace facewright
