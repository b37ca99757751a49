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
  Eigen::MatrixXd rows(int accessor, int columns) {
    Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> m(count(accessor), columns);
    seek(accessor, m.size(), sizeof(float));
    in_.array(m.data(), static_cast<size_t>(m.size()));
    return m.cast<double>();
  }
  Faces triangles(int accessor) {
    Faces F(count(accessor) / 3, 3);
    seek(accessor, F.size(), sizeof(std::uint32_t));
    in_.array(F.data(), static_cast<size_t>(F.size()));
    return F;
  }

 private:
  Eigen::Index count(int accessor) const {
    return description_.at("accessors").at(static_cast<size_t>(accessor)).at("count");
  }
  void seek(int accessor, Eigen::Index values, size_t size) {
    const json& view =
        description_.at("bufferViews")
            .at(description_.at("accessors").at(static_cast<size_t>(accessor)).at("bufferView").get<size_t>());
    in_.seek(start_ + view.at("byteOffset").get<size_t>());
    in_.expect(static_cast<size_t>(values), size);
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
  p.shape.basis.resize(p.shape.mean.size(), k);
  p.shape.variances = Eigen::VectorXd::Ones(k);
  p.shape.orthonormal = k == 0;
  for (Eigen::Index i = 0; i < k; ++i)
    p.shape.basis.col(i) = flat(glb.rows(targets.at(static_cast<size_t>(i)).at("POSITION"), 3));
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
