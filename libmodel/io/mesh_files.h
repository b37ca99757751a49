// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "libmodel/core/mesh.h"

namespace facewright {

/// Reads .obj or .ply (by extension), keeping the order of vertices and polygons; polygons are fanned from their first
/// corner. Malformed files throw IoError ("path:line: ..." in text files); counts are checked against the file's size
/// before anything is allocated. Coordinates beyond 1e15 are refused.
///   OBJ: `v x y z [w | r g b]`, `vt`, `f` with negative indices; colours are sRGB, 0..1 (0..255 if one exceeds 1).
///        Wedge coordinates become uv_faces unless they coincide with the vertices; corners without vt point to an
///        appended row (0, 0). Normals, groups, lines and materials are skipped (see texture_file).
///   PLY: ascii, binary little and big endian; x y z, red green blue [diffuse_*] (bytes, or floats 0..1), s t | u v |
///        texture_u texture_v, lists vertex_indices | vertex_index, per-face texcoord lists; anything else is skipped.
/// Colours come out linear.
Mesh read_mesh(const std::filesystem::path& path);

/// The texture image a mesh file names (OBJ: first map_Kd of its mtllib; PLY: comment TextureFile), if it names one
/// and the file exists in the mesh's folder or below it; else the file of that name beside the mesh, if there is one.
std::optional<std::filesystem::path> texture_file(const std::filesystem::path& mesh_path);

enum class PlyFormat { binary, ascii };
/// Positions: float32 in binary (little endian), shortest exact float64 text in ascii. Colours become sRGB uchar. One
/// uv per vertex goes to s t, wedge coordinates to a texcoord list per face. Written atomically. Throws IoError;
/// InvalidInput for a mesh that `validate` rejects.
void write_ply(const std::filesystem::path& path, const Mesh& mesh, PlyFormat format = PlyFormat::binary);

struct ObjMaterial {
  std::string texture_file;  ///< name of the image beside the OBJ
};
/// Positions and coordinates as shortest exact float64 text, colours as sRGB 0..1 after the position. With a material,
/// a .mtl of the same stem is written beside it. Written atomically. Throws like write_ply.
void write_obj(const std::filesystem::path& path, const Mesh& mesh, const std::optional<ObjMaterial>& material = {});

}  // namespace facewright
