// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/gltf_container.h"

#include <limits>

#include "libmodel/core/errors.h"

namespace facewright {

int GltfBuffer::view(const void* data, size_t bytes, int target) {
  bytes_.pad(4, '\0');
  Json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes}};
  if (target != 0) view["target"] = target;
  views_.push_back(std::move(view));
  bytes_.array(static_cast<const char*>(data), bytes);
  return static_cast<int>(views_.size()) - 1;
}

int GltfBuffer::add(const RowMatrixXf& m, bool bounds) {
  Json accessor = {{"bufferView", view(m.data(), static_cast<size_t>(m.size()) * sizeof(float), GltfCode::vertex_data)},
                   {"componentType", GltfCode::float32},
                   {"count", m.rows()},
                   {"type", m.cols() == 2 ? "VEC2" : "VEC3"}};
  if (bounds) {
    const Eigen::RowVectorXf low = m.colwise().minCoeff(), high = m.colwise().maxCoeff();
    accessor["min"] = std::vector<float>(low.begin(), low.end());
    accessor["max"] = std::vector<float>(high.begin(), high.end());
  }
  accessors_.push_back(std::move(accessor));
  return static_cast<int>(accessors_.size()) - 1;
}

int GltfBuffer::add(const Faces& F) {
  accessors_.push_back(
      {{"bufferView", view(F.data(), static_cast<size_t>(F.size()) * sizeof(int), GltfCode::index_data)},
       {"componentType", GltfCode::unsigned32},
       {"count", F.size()},
       {"type", "SCALAR"}});
  return static_cast<int>(accessors_.size()) - 1;
}

int GltfBuffer::add_bytes(const std::string& content) { return view(content.data(), content.size(), 0); }

std::string GltfBuffer::file(Json gltf) {
  bytes_.pad(4, '\0');
  gltf["accessors"] = accessors_;
  gltf["bufferViews"] = views_;
  gltf["buffers"] = Json::array({{{"byteLength", bytes_.size()}}});
  ByteWriter text, out;
  text.text(gltf.dump(-1, ' ', false, Json::error_handler_t::replace));
  text.pad(4, ' ');
  const size_t total = 12 + 8 + text.size() + 8 + bytes_.size();
  if (total > std::numeric_limits<std::uint32_t>::max())
    throw InvalidInput("glb: the file would be larger than 4 GB; choose fewer morph targets");
  out.value(GltfCode::magic);
  out.value(std::uint32_t{2});
  out.value(static_cast<std::uint32_t>(total));
  out.value(static_cast<std::uint32_t>(text.size()));
  out.value(GltfCode::json_chunk);
  out.text(text.bytes());
  out.value(static_cast<std::uint32_t>(bytes_.size()));
  out.value(GltfCode::binary_chunk);
  out.text(bytes_.bytes());
  return out.take();
}

}  // namespace facewright
