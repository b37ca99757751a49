// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <nlohmann/json.hpp>

#include "libmodel/core/mesh.h"
#include "libmodel/interop/byte_writer.h"

namespace facewright {

// Private to this module.

/// Numbers of the glTF 2.0 specification.
struct GltfCode {
  static constexpr int float32 = 5126, unsigned32 = 5125, unsigned16 = 5123, vertex_data = 34962, index_data = 34963;
  static constexpr std::uint32_t magic = 0x46546c67, json_chunk = 0x4e4f534a, binary_chunk = 0x004e4942;
};

/// Collects the binary chunk of a GLB and the accessors and views that describe it.
class GltfBuffer {
 public:
  using RowMatrixXf = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  using Json = nlohmann::ordered_json;

  /// An accessor of (N x 2) or (N x 3) floats, with its bounds if asked for; its index.
  int add(const RowMatrixXf& m, bool bounds);
  int add(const Faces& F);
  /// A view of plain bytes, such as an image file; its index.
  int add_bytes(const std::string& content);
  /// The whole file: `gltf` completed by what was collected.
  std::string file(Json gltf);

 private:
  int view(const void* data, size_t bytes, int target);
  Json accessors_ = Json::array(), views_ = Json::array();
  ByteWriter bytes_;
};

}  // namespace facewright
