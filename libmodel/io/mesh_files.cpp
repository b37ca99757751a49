// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/mesh_files.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/folder_bounds.h"
#include "libmodel/io/mesh_formats.h"
#include "libmodel/io/text_scanner.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

/// What follows `keyword` on the first line that starts with it.
std::string value_of(std::string_view text, std::string_view keyword, std::string_view second = {}) {
  TextScanner scan(text, "");
  for (; !scan.at_end(); scan.next_line())
    if (scan.token() == keyword && (second.empty() || scan.token() == second)) return std::string(scan.rest_of_line());
  return {};
}

std::string obj_texture(const fs::path& mesh_path) {
  const std::string library = value_of(read_file(mesh_path), "mtllib");
  const fs::path mtl = mesh_path.parent_path() / library;
  if (library.empty() || !is_file(mtl) || !lies_inside(mtl, mesh_path.parent_path())) return {};
  const std::string value = value_of(read_file(mtl), "map_Kd");
  if (value.empty() || value[0] != '-') return value;
  return value.substr(value.find_last_of(" \t") + 1);  // options before the name, e.g. -clamp on
}

std::string ply_texture(const fs::path& mesh_path) {
  const std::string bytes = read_file(mesh_path);
  const std::string_view header = std::string_view(bytes).substr(0, bytes.find("end_header"));
  return value_of(header, "comment", "TextureFile");
}

// Squares of larger numbers, hence distances, are no numbers any more.
Mesh measurable(Mesh mesh, const fs::path& path) {
  constexpr double kFarthest = 1e15;
  if (mesh.V.size() > 0 && mesh.V.cwiseAbs().maxCoeff() > kFarthest)
    throw IoError(path.string(), "has a vertex beyond 1e15 units, which no scan has; it is damaged");
  return mesh;
}

}  // namespace

Mesh read_mesh(const fs::path& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".obj") return measurable(parse_obj(read_file(path), path.string()), path);
  if (extension == ".ply") return measurable(parse_ply(read_file(path), path.string()), path);
  throw IoError(path.string(), "expected a mesh in .obj or .ply, got '" + extension + "'");
}

std::string texture_name(const fs::path& mesh_path) {
  std::string name = lower_extension(mesh_path) == ".obj" ? obj_texture(mesh_path) : ply_texture(mesh_path);
  std::replace(name.begin(), name.end(), '\\', '/');
  return name;
}

std::optional<fs::path> texture_file(const fs::path& mesh_path) {
  const std::string name = texture_name(mesh_path);
  if (name.empty()) return {};
  const fs::path folder = mesh_path.parent_path(), image = folder / name, beside = folder / fs::path(name).filename();
  for (const fs::path& file : {image, beside})
    if (is_file(file) && lies_inside(file, folder)) return file;
  return {};
}

void set_wedge_uv(Mesh& mesh, TexCoords uv, Faces uv_faces) {
  if ((uv_faces.array() < 0).any()) {  // corners without coordinates
    uv.conservativeResize(uv.rows() + 1, 2);
    uv.row(uv.rows() - 1).setZero();
    const int missing = static_cast<int>(uv.rows() - 1);
    uv_faces = (uv_faces.array() < 0).select(missing, uv_faces);
  }
  const bool per_vertex = uv.rows() == mesh.V.rows() && uv_faces == mesh.F;
  mesh.uv = std::move(uv);
  if (!per_vertex) mesh.uv_faces = std::move(uv_faces);
}

}  // namespace facewright
