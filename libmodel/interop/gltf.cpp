// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/gltf.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/interop/byte_writer.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;
using RowMatrixXf = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr int kFloat = 5126, kUnsigned = 5125, kVertexData = 34962, kIndexData = 34963;  // of glTF
constexpr double kMetresPerMillimetre = 1e-3;

// Collects the binary chunk and what describes it.
class Buffers {
 public:
  int add(const RowMatrixXf& m, const char* type, bool bounds) {
    Json accessor = view(m.data(), static_cast<size_t>(m.size()), kVertexData);
    accessor.update({{"componentType", kFloat}, {"count", m.rows()}, {"type", type}});
    if (bounds) {
      const Eigen::RowVectorXf low = m.colwise().minCoeff(), high = m.colwise().maxCoeff();
      accessor["min"] = std::vector<float>(low.begin(), low.end());
      accessor["max"] = std::vector<float>(high.begin(), high.end());
    }
    accessors.push_back(std::move(accessor));
    return static_cast<int>(accessors.size()) - 1;
  }
  int add(const Faces& F) {
    Json accessor = view(F.data(), static_cast<size_t>(F.size()), kIndexData);
    accessor.update({{"componentType", kUnsigned}, {"count", F.size()}, {"type", "SCALAR"}});
    accessors.push_back(std::move(accessor));
    return static_cast<int>(accessors.size()) - 1;
  }
  Json accessors = Json::array(), views = Json::array();
  ByteWriter bytes;

 private:
  template <class T>
  Json view(const T* data, size_t count, int target) {
    views.push_back(
        {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", count * sizeof(T)}, {"target", target}});
    bytes.array(data, count);
    return Json{{"bufferView", views.size() - 1}};
  }
};

RowMatrixXf metres(const Eigen::VectorXd& x) { return (as_vertices(x) * kMetresPerMillimetre).cast<float>(); }

std::string container(const Json& json, ByteWriter& binary) {
  ByteWriter text, out;
  text.text(json.dump());
  text.pad(4, ' ');
  binary.pad(4, '\0');
  out.value(std::uint32_t{0x46546c67});  // "glTF"
  out.value(std::uint32_t{2});
  out.value(static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary.size()));
  out.value(static_cast<std::uint32_t>(text.size()));
  out.value(std::uint32_t{0x4e4f534a});  // "JSON"
  out.text(text.bytes());
  out.value(static_cast<std::uint32_t>(binary.size()));
  out.value(std::uint32_t{0x004e4942});  // "BIN"
  out.text(binary.bytes());
  return out.take();
}

}  // namespace

std::string glb_bytes(const MorphableModel& model, int targets) {
  if (model.level_count() != 1) throw InvalidInput("glb: a file holds one level; choose one");
  const Mesh mean = model.mean();
  Buffers buffers;
  Json attributes, morphs = Json::array(), names = Json::array(), weights = Json::array();
  attributes["POSITION"] = buffers.add(metres(as_vector(mean.V)), "VEC3", true);
  if (mean.has_colours()) attributes["COLOR_0"] = buffers.add(mean.colours.cast<float>(), "VEC3", false);
  if (mean.has_uv()) {
    TexCoords uv = mean.uv;
    uv.col(1) = 1 - uv.col(1).array();  // glTF's v runs down
    attributes["TEXCOORD_0"] = buffers.add(uv.cast<float>(), "VEC2", false);
  }
  const int indices = buffers.add(mean.F);
  const auto count = std::min<Eigen::Index>(targets, model.shape().mode_count());
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::VectorXd step = std::sqrt(model.shape().variances[k]) * model.shape().basis.col(k);
    morphs.push_back({{"POSITION", buffers.add(metres(step), "VEC3", true)}});
    names.push_back("shape " + std::to_string(k + 1));
    weights.push_back(0);
  }
  Json primitive = {{"attributes", attributes}, {"indices", indices}, {"material", 0}};
  Json mesh = {{"name", "mean face"}};
  if (count > 0) {
    primitive["targets"] = morphs;
    mesh["weights"] = weights;
    mesh["extras"] = {{"targetNames", names}};
  }
  mesh["primitives"] = Json::array({primitive});
  const Json material = {{"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 0.9}}},
                         {"doubleSided", true}};
  buffers.bytes.pad(4, '\0');
  const Json gltf = {{"asset", {{"version", "2.0"}, {"generator", "Facewright"}}},
                     {"scene", 0},
                     {"scenes", Json::array({{{"nodes", Json::array({0})}}})},
                     {"nodes", Json::array({{{"mesh", 0}, {"name", "face"}}})},
                     {"materials", Json::array({material})},
                     {"meshes", Json::array({mesh})},
                     {"accessors", buffers.accessors},
                     {"bufferViews", buffers.views},
                     {"buffers", Json::array({{{"byteLength", buffers.bytes.size()}}})}};
  return container(gltf, buffers.bytes);
}

}  // namespace facewright
