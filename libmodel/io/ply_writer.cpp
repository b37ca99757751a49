// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <bit>
#include <cstdint>
#include <cstring>

#include "libmodel/core/errors.h"
#include "libmodel/core/image.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/io/text_builder.h"

namespace facewright {
namespace {

static_assert(std::endian::native == std::endian::little, "binary PLY is written in host order");

/// Values in the order of the file, as bytes or as text.
class PlySink {
 public:
  PlySink(std::string& out, PlyFormat format) : out_(out), binary_(format == PlyFormat::binary) {}
  void real(double x) { binary_ ? raw(static_cast<float>(x)) : text(x); }
  void byte(std::uint8_t x) { binary_ ? raw(x) : text(static_cast<int>(x)); }
  void integer(std::int32_t x) { binary_ ? raw(x) : text(x); }
  void end_item() {
    if (!binary_) out_.back() = '\n';
  }

 private:
  template <typename T>
  void raw(T x) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &x, sizeof(T));
    out_.append(bytes, sizeof(T));
  }
  template <typename T>
  void text(T x) {
    append_number(out_, x);
    out_ += ' ';
  }
  std::string& out_;
  bool binary_;
};

std::string header(const Mesh& mesh, PlyFormat format) {
  const bool binary = format == PlyFormat::binary, wedges = mesh.uv_faces.rows() > 0;
  const std::string real = binary ? "property float " : "property double ";
  std::string h = std::string("ply\nformat ") + (binary ? "binary_little_endian" : "ascii") + " 1.0\n";
  h += "element vertex " + std::to_string(mesh.V.rows()) + "\n" + real + "x\n" + real + "y\n" + real + "z\n";
  if (mesh.has_colours()) h += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (mesh.has_uv() && !wedges) h += real + "s\n" + real + "t\n";
  h += "element face " + std::to_string(mesh.F.rows()) + "\nproperty list uchar int vertex_indices\n";
  if (wedges) h += std::string("property list uchar ") + (binary ? "float" : "double") + " texcoord\n";
  return h + "end_header\n";
}

}  // namespace

void write_ply(const std::filesystem::path& path, const Mesh& mesh, PlyFormat format) {
  validate(mesh);
  const bool wedges = mesh.uv_faces.rows() > 0;
  std::string out = header(mesh, format);
  out.reserve(out.size() + static_cast<size_t>(mesh.V.rows() * 60 + mesh.F.rows() * 40));
  PlySink sink(out, format);
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i) {
    for (int k = 0; k < 3; ++k) sink.real(mesh.V(i, k));
    for (int k = 0; k < 3 && mesh.has_colours(); ++k) sink.byte(srgb8_from_linear(mesh.colours(i, k)));
    for (int k = 0; k < 2 && mesh.has_uv() && !wedges; ++k) sink.real(mesh.uv(i, k));
    sink.end_item();
  }
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    sink.byte(3);
    for (int k = 0; k < 3; ++k) sink.integer(mesh.F(f, k));
    if (wedges) {
      sink.byte(6);
      for (int k = 0; k < 6; ++k) sink.real(mesh.uv(mesh.uv_faces(f, k / 2), k % 2));
    }
    sink.end_item();
  }
  write_file(path, out);
}

}  // namespace facewright
