// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/mesh_content.h"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string_view>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

struct Magic {
  std::string_view bytes;
  const char* what;
};

constexpr Magic kNoMesh[] = {{"\x89PNG", "a PNG picture"},    {"\xff\xd8\xff", "a JPEG picture"},
                             {"GIF8", "a GIF picture"},       {"BM", "a BMP picture"},
                             {"PK\x03\x04", "a ZIP archive"}, {"\x1f\x8b", "a gzip archive"},
                             {"Rar!", "a RAR archive"},       {"7z\xbc\xaf", "a 7z archive"},
                             {"%PDF", "a PDF document"},      {"\x89HDF", "an HDF5 file"}};

// Lines of an OBJ begin with one of a few words; the first few that do decide.
bool looks_like_obj(const std::string& text) {
  std::istringstream lines(text);
  int vertices = 0;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word;
    double x = 0, y = 0, z = 0;
    if (!(words >> word) || word[0] == '#' || word == "mtllib" || word == "o" || word == "g" || word == "usemtl" ||
        word == "s" || word == "vt" || word == "vn")
      continue;
    if (word != "v" || !(words >> x >> y >> z)) return lines.eof() && vertices > 0;  // the last line may be cut
    if (++vertices == 8) return true;
  }
  return vertices > 0;
}

}  // namespace

std::string mesh_format_by_content(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw IoError(file.string(), "cannot be opened");
  std::string head(4096, '\0');
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<size_t>(stream.gcount()));
  for (const Magic& magic : kNoMesh)
    if (head.starts_with(magic.bytes))
      throw IoError(file.string(), std::string("is ") + magic.what + ", not a mesh; export the scan as OBJ or PLY");
  if (head.starts_with("ply\n") || head.starts_with("ply\r")) return ".ply";
  if (head.starts_with("glTF")) return ".glb";
  if (head.starts_with("OFF") || head.starts_with("COFF") || head.starts_with("NOFF")) return ".off";
  std::uint32_t triangles = 0;
  if (head.size() > 84) std::memcpy(&triangles, head.data() + 80, 4);
  if (head.size() > 84 && std::filesystem::file_size(file) == 84 + 50 * static_cast<std::uintmax_t>(triangles))
    return ".stl";
  if (head.starts_with("solid") && head.find("facet") != head.npos) return ".stl";
  if (looks_like_obj(head)) return ".obj";
  return {};
}

}  // namespace facewright
