// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/core/errors.h"
#include "libmodel/core/image.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/io/text_builder.h"

namespace facewright {
namespace {

void append_vertices(std::string& out, const Mesh& mesh) {
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i) {
    out += "v ";
    append_row(out, mesh.V.row(i));
    for (int k = 0; k < 3 && mesh.has_colours(); ++k) {
      out += ' ';
      append_number(out, static_cast<float>(srgb_from_linear(mesh.colours(i, k))));
    }
    out += '\n';
  }
}

void append_faces(std::string& out, const Mesh& mesh) {
  const Faces& corners = mesh.uv_faces.rows() > 0 ? mesh.uv_faces : mesh.F;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    out += 'f';
    for (int k = 0; k < 3; ++k) {
      out += ' ';
      append_number(out, mesh.F(f, k) + 1);
      if (!mesh.has_uv()) continue;
      out += '/';
      append_number(out, corners(f, k) + 1);
    }
    out += '\n';
  }
}

std::filesystem::path write_material(std::filesystem::path path, const ObjMaterial& material) {
  path.replace_extension(".mtl");
  write_file(path, "newmtl face\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd " + material.texture_file + "\n");
  return path.filename();
}

}  // namespace

void write_obj(const std::filesystem::path& path, const Mesh& mesh, const std::optional<ObjMaterial>& material) {
  validate(mesh);
  std::string out;
  out.reserve(static_cast<size_t>(mesh.V.rows() * 60 + mesh.F.rows() * 40));
  if (material) out += "mtllib " + write_material(path, *material).string() + "\n";
  append_vertices(out, mesh);
  for (Eigen::Index i = 0; i < mesh.uv.rows(); ++i) {
    out += "vt ";
    append_row(out, mesh.uv.row(i));
    out += '\n';
  }
  if (material) out += "usemtl face\n";
  append_faces(out, mesh);
  write_file(path, out);
}

}  // namespace facewright
