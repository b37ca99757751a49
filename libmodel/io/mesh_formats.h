// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: the readers behind read_mesh, one per format.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "libmodel/core/mesh.h"

namespace facewright {

Mesh parse_obj(std::string_view text, const std::string& path);
/// Positions that are not finite in binary files are refused, or kept for who can mend them.
enum class NonFinite { refuse, keep };
Mesh parse_ply(std::string_view bytes, const std::string& path, NonFinite non_finite = NonFinite::refuse);

/// The picture that a mesh file names, as it stands there with slashes; empty if none.
std::string texture_name(const std::filesystem::path& mesh_path);

/// Gives the mesh texture coordinates per corner; collapses to one per vertex where corner and vertex indices agree.
void set_wedge_uv(Mesh& mesh, TexCoords uv, Faces uv_faces);

}  // namespace facewright
