// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <cmath>

#include "libmodel/interop/byte_reader.h"
#include "libmodel/interop/gltf.h"
#include "libmodel/interop/gltf_container.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/json_depth.h"
#include "libmodel/io/json_whole.h"
#include "libmodel/model/surface_points.h"

namespace facewright {
namespace {

using nlohmann::json;

constexpr double kMillimetresPerMetre = 1e3;

// The accessors of a GLB: packed floats or unsigned integers, one buffer.
class Glb {
 public:
  explicit Glb(const std::filesystem::path& path) : bytes_(read_file(path)), in_(bytes_, path.string()) {
    if (in_.value<std::uint32_t>() != GltfCode::magic || in_.value<std::uint32_t>() != 2)
      in_.fail("is no GLB of version 2");
    if (const auto length = in_.value<std::uint32_t>(); length > bytes_.size())
      in_.fail("ends too early: " + std::to_string(bytes_.size()) + " of " + std::to_string(length) +
               " bytes are here");
    const auto length = in_.value<std::uint32_t>();
    if (in_.value<std::uint32_t>() != GltfCode::json_chunk) in_.fail("does not begin with its description");
    const std::string description = in_.text(length);
    if (json_depth(description) > kMostJsonDepth) in_.fail("nests its description too deeply; it is damaged");
    description_ = json::parse(description);
    in_.text(8);
    start_ = in_.position();
  }
  const json& description() const { return description_; }
  [[noreturn]] void fail(const std::string& what) const { in_.fail(what); }
  Eigen::MatrixXd rows(const json& index, int columns) {
    const auto accessor = whole_number<size_t>(index);
    const Eigen::Index n =
        seek(accessor, columns == 3 ? "VEC3" : "VEC2", GltfCode::float32, static_cast<size_t>(columns) * sizeof(float));
    Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> m(n, columns);
    in_.array(m.data(), static_cast<size_t>(m.size()));
    return m.cast<double>();
  }
  Faces triangles(const json& index) {
    const auto accessor = whole_number<size_t>(index);
    const json& kind = description_.at("accessors").at(accessor).at("componentType");
    return kind == GltfCode::unsigned16 ? corners<std::uint16_t>(accessor, GltfCode::unsigned16)
                                        : corners<std::int32_t>(accessor, GltfCode::unsigned32);
  }
  /// Throws if the file cannot hold so many items of `size` bytes; call it before memory is taken for them.
  void expect(size_t items, size_t size) const {
    if (size > 0 && items > bytes_.size() / size) fail("ends too early");
  }

 private:
  template <class T>
  Faces corners(size_t accessor, int component) {
    const Eigen::Index count = seek(accessor, "SCALAR", component, sizeof(T));
    if (count % 3 != 0) fail("has " + std::to_string(count) + " triangle corners, not a multiple of 3");
    Eigen::Matrix<T, Eigen::Dynamic, 3, Eigen::RowMajor> F(count / 3, 3);
    in_.array(F.data(), static_cast<size_t>(F.size()));
    return F.template cast<int>();
  }
  // To the first of an accessor's elements, of `size` bytes each; returns how many there are.
  Eigen::Index seek(size_t index, const std::string& type, int component, size_t size) {
    const json& accessor = description_.at("accessors").at(index);
    if (accessor.at("type") != type || accessor.at("componentType") != component)
      fail("has an accessor of another kind than " + type + " " + std::to_string(component));
    if (accessor.contains("sparse")) fail("has a sparse accessor; save it without");
    const json& view = description_.at("bufferViews").at(whole_number<size_t>(accessor.at("bufferView")));
    if (view.contains("byteStride") && view.at("byteStride") != size)
      fail("has interleaved attributes; save them apart");
    const auto offset_of = [](const json& at) {
      return at.contains("byteOffset") ? whole_number<size_t>(at.at("byteOffset")) : size_t{0};
    };
    const size_t offset = offset_of(view), inner = offset_of(accessor);
    expect(offset, 1);
    expect(inner, 1);
    in_.seek(start_ + offset + inner);
    const auto count = whole_number<size_t>(accessor.at("count"));
    in_.expect(count, size);
    return static_cast<Eigen::Index>(count);
  }
  std::string bytes_;
  ByteReader in_;
  json description_;
  size_t start_ = 0;
};

Eigen::VectorXd flat(const Eigen::MatrixXd& m) { return as_vector(Vertices(m)); }

// One morph target: its name, and what our own metadata say of it.
struct Target {
  std::string name, kind;
  double sigma = 0;
  Eigen::VectorXd step;
};

std::vector<Target> read_targets(Glb& glb, const json& mesh, const json& primitive, Eigen::Index size) {
  const json list = primitive.value("targets", json::array()), extras = mesh.value("extras", json::object());
  const json names = extras.value("targetNames", json::array());
  const json own = extras.value("facewright", json::object()).value("targets", json::array());
  glb.expect(list.size(), static_cast<size_t>(size) * sizeof(float));
  std::vector<Target> targets;
  for (size_t i = 0; i < list.size(); ++i) {
    Target t{i < names.size() ? names[i].get<std::string>() : "target " + std::to_string(i + 1), "blendshape", 0,
             flat(glb.rows(list[i].at("POSITION"), 3)) * kMillimetresPerMetre};
    if (t.step.size() != size)
      glb.fail("has a morph target of " + std::to_string(t.step.size() / 3) + " vertices for a mesh of " +
               std::to_string(size / 3));
    if (i < own.size()) {
      t.kind = own[i].at("kind").get<std::string>();
      t.sigma = own[i].value("sigma_mm", 0.0);
      if (!std::isfinite(t.sigma) || t.sigma < 0) glb.fail("has a morph target whose sigma is no length");
    }
    targets.push_back(std::move(t));
  }
  return targets;
}

PcaModel modes(const std::vector<Target>& targets, const std::string& kind, Eigen::VectorXd mean) {
  PcaModel pca;
  const auto count = std::count_if(targets.begin(), targets.end(), [&](const Target& t) { return t.kind == kind; });
  pca.basis.resize(mean.size(), count);
  pca.variances.resize(count);
  pca.mean = std::move(mean);
  Eigen::Index k = 0;
  for (const Target& t : targets)
    if (t.kind == kind) {
      pca.variances[k] = t.sigma > 0 ? t.sigma * t.sigma : 0;
      pca.basis.col(k++) = t.sigma > 0 ? Eigen::VectorXd(t.step / t.sigma) : t.step;
    }
  const Eigen::MatrixXd gram = pca.basis.transpose() * pca.basis;
  pca.orthonormal = (gram - Eigen::MatrixXd::Identity(count, count)).cwiseAbs().sum() < 1e-4;
  return pca;
}

void read_colours(Glb& glb, const json& attributes, MorphableModelParts& p) {
  for (const char* name : {"_MEAN_COLOR", "COLOR_0"})
    if (attributes.contains(name)) {
      p.colour.mean = flat(glb.rows(attributes.at(name), 3));
      p.colour.basis.resize(p.colour.mean.size(), 0);
      return;
    }
}

MorphableModelParts parts_of(Glb& glb) {
  const json& mesh = glb.description().at("meshes").at(0);
  const json& primitive = mesh.at("primitives").at(0);
  const json& attributes = primitive.at("attributes");
  MorphableModelParts p;
  const Eigen::VectorXd mean = flat(glb.rows(attributes.at("POSITION"), 3)) * kMillimetresPerMetre;
  const std::vector<Target> targets = read_targets(glb, mesh, primitive, mean.size());
  p.shape = modes(targets, "shape", mean);
  Eigen::VectorXd expression_mean = Eigen::VectorXd::Zero(mean.size());
  bool has_expression = false;
  for (const Target& t : targets) {
    if (t.kind == "expression mean") expression_mean = t.step;
    has_expression = has_expression || t.kind.starts_with("expression");
    if (t.kind == "blendshape") p.blendshapes.push_back({t.name, t.step});
  }
  if (has_expression) p.expression = modes(targets, "expression", expression_mean);
  read_colours(glb, attributes, p);
  if (attributes.contains("TEXCOORD_0")) {
    p.uv = glb.rows(attributes.at("TEXCOORD_0"), 2);
    p.uv.col(1) = 1 - p.uv.col(1).array();
  }
  p.levels = {{static_cast<int>(p.shape.vertex_count()), glb.triangles(primitive.at("indices"))}};
  const json own = mesh.value("extras", json::object()).value("facewright", json::object());
  const json landmarks = own.value("landmark_vertices", json::object());
  for (const auto& [name, v] : landmarks.items())
    p.landmarks[name] = {point_at_vertex(p.levels[0].F, whole_number<int>(v)), whole_number<int>(v)};
  return p;
}

}  // namespace

MorphableModel read_glb_model(const std::filesystem::path& path) {
  try {
    Glb glb(path);
    return MorphableModel(parts_of(glb));
  } catch (const json::exception& error) {
    throw IoError(path.string(), std::string("has an unexpected content: ") + error.what());
  } catch (const InvalidInput& error) {
    throw IoError(path.string(), error.what());
  }
}

}  // namespace facewright
