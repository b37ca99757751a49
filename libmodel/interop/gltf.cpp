// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/gltf.h"

#include <algorithm>

#include "libmodel/core/errors.h"
#include "libmodel/interop/baked_texture.h"
#include "libmodel/interop/gltf_scene.h"
#include "libmodel/io/image_files.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;
struct MorphTarget {
  std::string name, kind;
  double sigma = 0;  // mm; 0 = not a mode
  Eigen::VectorXd step;
};

void add_modes(std::vector<MorphTarget>& targets, const std::string& kind, const PcaModel& pca, int most) {
  for (Eigen::Index k = 0; k < std::min<Eigen::Index>(most, pca.mode_count()); ++k) {
    const double sigma = std::sqrt(pca.variances[k]);
    targets.push_back({kind + " " + std::to_string(k + 1), kind, sigma, sigma * pca.basis.col(k)});
  }
}

std::vector<MorphTarget> morph_targets(const MorphableModel& model, int modes) {
  std::vector<MorphTarget> targets;
  add_modes(targets, "shape", model.shape(), modes);
  if (model.expression()) {
    if (!model.expression()->mean.isZero(0))
      targets.push_back({"expression mean", "expression mean", 0, model.expression()->mean});
    add_modes(targets, "expression", *model.expression(), modes);
  }
  for (const Blendshape& b : model.blendshapes()) targets.push_back({b.name, "blendshape", 0, b.displacement});
  return targets;
}

// The model's own numbers beside those that every viewer knows.
Json own_extras(const MorphableModel& model, const std::vector<MorphTarget>& targets) {
  Json kinds = Json::array(), landmarks = Json::object();
  for (const MorphTarget& t : targets) {
    Json entry = {{"kind", t.kind}};
    if (t.sigma > 0) entry["sigma_mm"] = t.sigma;
    kinds.push_back(std::move(entry));
  }
  for (const auto& [name, mark] : model.landmarks()) landmarks[name] = mark.vertex;
  return {{"format", "facewright-glb 1"},
          {"units", "m"},
          {"mean", "POSITION"},
          {"weight_unit", "standard deviations of modes; 1 = the whole of others"},
          {"shape_modes_in_model", model.shape().mode_count()},
          {"targets", kinds},
          {"landmark_vertices", landmarks}};
}

Json morph_attributes(GltfBuffer& buffer, const MorphableModel& model, const MorphTarget& target,
                      const Vertices& normals, bool with_normals) {
  Json attributes = {{"POSITION", buffer.add(gltf_positions(as_vertices(target.step)), true)}};
  if (with_normals) {
    const Vertices moved = unit_vertex_normals(as_vertices(model.shape().mean + target.step), model.faces());
    attributes["NORMAL"] = buffer.add((moved - normals).cast<float>(), false);
  }
  return attributes;
}

// The mean's colour: a texture where there are texture coordinates, else at the vertices. Returns the material.
Json add_colour(GltfBuffer& buffer, const Mesh& mean, int texture_size, Json& attributes, Json& gltf) {
  Json material = gltf_skin();
  const bool textured = mean.has_colours() && mean.has_uv() && texture_size > 0;
  if (mean.has_colours())
    attributes[textured ? "_MEAN_COLOR" : "COLOR_0"] = buffer.add(mean.colours.cast<float>(), false);
  if (mean.has_uv()) attributes["TEXCOORD_0"] = buffer.add(gltf_coordinates(mean.uv), false);
  if (textured)
    add_gltf_texture(gltf, material, buffer.add_bytes(png_bytes(baked_texture(mean, texture_size))), "mean colour");
  return material;
}

}  // namespace

std::string glb_bytes(const MorphableModel& model, const GltfOptions& options) {
  if (model.level_count() != 1) throw InvalidInput("glb: a file holds one level; choose one");
  if (options.modes < 0) throw InvalidInput("glb: modes is " + std::to_string(options.modes) + "; expected 0 or more");
  const Mesh mean = model.mean();
  const Vertices normals = unit_vertex_normals(as_vertices(model.shape().mean), mean.F);
  const std::vector<MorphTarget> targets = morph_targets(model, options.modes);
  GltfBuffer buffer;
  Json gltf = gltf_scene("face");
  Json attributes, morphs = Json::array(), names = Json::array();
  attributes["POSITION"] = buffer.add(gltf_positions(as_vertices(model.shape().mean)), true);
  attributes["NORMAL"] = buffer.add(normals.cast<float>(), false);
  const Json material = add_colour(buffer, mean, options.texture_size, attributes, gltf);
  const int indices = buffer.add(mean.F);
  for (const MorphTarget& target : targets) {
    morphs.push_back(morph_attributes(buffer, model, target, normals, options.morph_normals));
    names.push_back(target.name);
  }
  Json primitive = {{"attributes", attributes}, {"indices", indices}, {"material", 0}}, mesh = {{"name", "mean face"}};
  mesh["extras"] = {{"facewright", own_extras(model, targets)}};
  if (!targets.empty()) {
    primitive["targets"] = morphs;
    mesh["weights"] = std::vector<int>(targets.size(), 0);
    mesh["extras"]["targetNames"] = names;
  }
  mesh["primitives"] = Json::array({primitive});
  gltf["materials"] = Json::array({material});
  gltf["meshes"] = Json::array({mesh});
  return buffer.file(std::move(gltf));
}

}  // namespace facewright
