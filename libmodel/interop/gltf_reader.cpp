// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <nlohmann/json.hpp>

#include "libmodel/interop/byte_reader.h"
#include "libmodel/interop/gltf.h"
#include "libmodel/io/atomic_file.h"

namespace facewright {
namespace {

using nlohmann::json;

// The accessors of a file as glb_bytes writes it: packed floats or unsigned integers, one buffer.
class Glb {
 public:
  explicit Glb(const std::filesystem::path& path) : bytes_(read_file(path)), in_(bytes_, path.string()) {
    if (in_.value<std::uint32_t>() != 0x46546c67 || in_.value<std::uint32_t>() != 2) in_.fail("is no GLB of version 2");
    in_.value<std::uint32_t>();
    const auto length = in_.value<std::uint32_t>();
    in_.value<std::uint32_t>();
    description_ = json::parse(in_.text(length));
    in_.text(8);
    start_ = in_.position();
  }
  const json& description() const { return description_; }
  [[noreturn]] void fail(const std::string& what) const { in_.fail(what); }
  Eigen::MatrixXd rows(size_t accessor, int columns) {
    const Eigen::Index n =
        seek(accessor, columns == 3 ? "VEC3" : "VEC2", 5126, static_cast<size_t>(columns) * sizeof(float));
    Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> m(n, columns);
    in_.array(m.data(), static_cast<size_t>(m.size()));
    return m.cast<double>();
  }
  Faces triangles(size_t accessor) {
    const Eigen::Index corners = seek(accessor, "SCALAR", 5125, sizeof(std::uint32_t));
    if (corners % 3 != 0) fail("has " + std::to_string(corners) + " triangle corners, not a multiple of 3");
    Faces F(corners / 3, 3);
    in_.array(F.data(), static_cast<size_t>(F.size()));
    return F;
  }
  /// Throws if the file cannot hold so many items of `size` bytes; call it before memory is taken for them.
  void expect(size_t items, size_t size) const {
    if (size > 0 && items > bytes_.size() / size) fail("ends too early");
  }

 private:
  // To the first of an accessor's elements, of `size` bytes each; returns how many there are.
  Eigen::Index seek(size_t index, const std::string& type, int component, size_t size) {
    const json& accessor = description_.at("accessors").at(index);
    if (accessor.at("type") != type || accessor.at("componentType") != component)
      fail("has an accessor of another kind than " + type + " " + std::to_string(component));
    const json& view = description_.at("bufferViews").at(accessor.at("bufferView").get<size_t>());
    const auto offset = view.at("byteOffset").get<size_t>();
    expect(offset, 1);
    in_.seek(start_ + offset);
    const auto count = accessor.at("count").get<size_t>();  // a negative one becomes huge
    in_.expect(count, size);
    return static_cast<Eigen::Index>(count);
  }
  std::string bytes_;
  ByteReader in_;
  json description_;
  size_t start_ = 0;
};

Eigen::VectorXd flat(const Eigen::MatrixXd& m) { return as_vector(Vertices(m)); }

MorphableModelParts parts_of(Glb& glb) {
  const json& primitive = glb.description().at("meshes").at(0).at("primitives").at(0);
  const json& attributes = primitive.at("attributes");
  MorphableModelParts p;
  p.shape.mean = flat(glb.rows(attributes.at("POSITION"), 3));
  const auto targets = primitive.value("targets", json::array());
  const auto k = static_cast<Eigen::Index>(targets.size());
  glb.expect(targets.size(), static_cast<size_t>(p.shape.mean.size()) * sizeof(float));
  p.shape.basis.resize(p.shape.mean.size(), k);
  p.shape.variances = Eigen::VectorXd::Ones(k);
  p.shape.orthonormal = k == 0;
  for (Eigen::Index i = 0; i < k; ++i) {
    const Eigen::VectorXd step = flat(glb.rows(targets.at(static_cast<size_t>(i)).at("POSITION"), 3));
    if (step.size() != p.shape.mean.size())
      glb.fail("has a morph target of " + std::to_string(step.size() / 3) + " vertices for a mesh of " +
               std::to_string(p.shape.vertex_count()));
    p.shape.basis.col(i) = step;
  }
  if (attributes.contains("COLOR_0")) {
    p.colour.mean = flat(glb.rows(attributes.at("COLOR_0"), 3));
    p.colour.basis.resize(p.colour.mean.size(), 0);
  }
  if (attributes.contains("TEXCOORD_0")) {
    p.uv = glb.rows(attributes.at("TEXCOORD_0"), 2);
    p.uv.col(1) = 1 - p.uv.col(1).array();
  }
  p.levels = {{static_cast<int>(p.shape.vertex_count()), glb.triangles(primitive.at("indices"))}};
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
