// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>
#include <cstring>

#include "libmodel/core/errors.h"
#include "libmodel/interop/import_model.h"
#include "libmodel/interop/mat_file.h"
#include "libmodel/interop/npy.h"
#include "libmodel/io/atomic_file.h"

namespace facewright {
namespace {

std::string sniff_mat(const std::filesystem::path& path) {
  const MatFile file(path);
  if (file.has("shapePC") && file.has("shapeMU")) return "bfm2009";
  if (file.has("components") && file.has("trilist")) return "lsfm";
  if (file.has("shp")) return "lyhm";
  std::string names;
  for (const std::string& name : file.names()) names += (names.empty() ? "" : ", ") + name;
  throw IoError(path.string(),
                "is a MATLAB file of no known model; it has " + (names.empty() ? "nothing" : names) +
                    "; known are shapeMU/shapePC/shapeEV (BFM 2009), mean/components/eigenvalues/trilist "
                    "(LSFM) and shp (LYHM)");
}

std::string sniff_npz(const std::filesystem::path& path) {
  const NpzArchive archive(path);
  if (archive.has("v_template")) return "flame";
  if (archive.has("shape_mean")) return "npz";
  throw IoError(path.string(),
                "is a NumPy archive of no known model; expected v_template and shapedirs (FLAME), or "
                "shape_mean and shape_basis (export-model)");
}

std::uint32_t number(const std::string& bytes, size_t at) {
  std::uint32_t x = 0;
  if (at + 4 <= bytes.size()) std::memcpy(&x, bytes.data() + at, 4);
  return x;
}

bool looks_like_eos(const std::string& bytes) {
  const std::uint32_t version = number(bytes, 0), rows = number(bytes, 4), columns = number(bytes, 8);
  return bytes.size() > 12 && version >= 1 && version <= 4 && columns == 1 && rows > 0 && rows % 3 == 0;
}

// Vertices, triangles, the triangles, then modes and a dimension of three per vertex.
bool looks_like_scm(const std::string& bytes) {
  const std::uint64_t vertices = number(bytes, 0), triangles = number(bytes, 4), at = 8 + 12 * triangles;
  return vertices > 2 && triangles > 0 && at + 8 < bytes.size() && number(bytes, at + 4) == 3 * vertices;
}

}  // namespace

const std::vector<std::string>& import_format_names() {
  static const std::vector<std::string> names = {"facewright", "statismo", "eos",   "bfm2009", "lsfm", "lyhm",
                                                 "scm",        "ict",      "flame", "npz",     "glb"};
  return names;
}

std::string sniff_model_format(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path)) return "ict";
  const std::string bytes = read_file(path);
  if (bytes.starts_with("MATLAB ")) return sniff_mat(path);
  if (bytes.starts_with("\x89HDF\r\n\x1a\n"))
    return bytes.find("facewright-model ") != bytes.npos ? "facewright" : "statismo";
  if (bytes.starts_with("PK")) return sniff_npz(path);
  if (bytes.starts_with("glTF")) return "glb";
  if (looks_like_eos(bytes)) return "eos";
  if (looks_like_scm(bytes)) return "scm";
  if (bytes.size() > 2 && bytes[0] == '\x80' && bytes[1] >= 2 && bytes[1] <= 5)
    throw IoError(path.string(),
                  "is a Python pickle: reading it would run its author's code; turn it into an .npz as "
                  "docs/interop.md shows");
  if (bytes.starts_with("{"))
    throw IoError(path.string(),
                  "is JSON; scalismo's HDF5-JSON files and glTF text cannot be read: save as .h5 or .glb");
  if (path.extension() == ".mat") return sniff_mat(path);  // version 4 has no signature
  throw IoError(path.string(), bytes.empty() ? "is empty" : "is no model file of a known format, or is cut short");
}

}  // namespace facewright
