// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "libmodel/interop/gltf_container.h"

namespace facewright {

// Private to this module: what every GLB of ours has in common.

/// A file of one scene with one node `name` that shows mesh 0.
GltfBuffer::Json gltf_scene(const std::string& name);
/// A matt material seen from both sides.
GltfBuffer::Json gltf_skin();
/// Colours `material` by the PNG image in a view of the buffer, clamped at the borders, smoothed when small.
void add_gltf_texture(GltfBuffer::Json& gltf, GltfBuffer::Json& material, int image_view, const std::string& name);

/// Millimetres in metres.
GltfBuffer::RowMatrixXf gltf_positions(const Vertices& V);
/// glTF's v runs down.
GltfBuffer::RowMatrixXf gltf_coordinates(TexCoords uv);
/// Unit vectors even where no triangle says which: the format demands it.
Vertices unit_vertex_normals(const Vertices& V, const Faces& F);

}  // namespace facewright
