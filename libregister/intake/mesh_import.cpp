// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/mesh_import.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/folder_bounds.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/io/mesh_formats.h"
#include "libregister/intake/assimp_reader.h"
#include "libregister/intake/mesh_content.h"
#include "libregister/intake/obj_materials.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

// Finds places again: an open table of their numbers in a list, twice as fast as nodes on the heap.
class PlaceIndex {
 public:
  void reserve(size_t places) { rehash(std::bit_ceil(2 * places + 16)); }
  /// The number of the place equal to p in `places`, or -1 after its next number, places.size(), was noted for it. What
  /// is not finite equals nothing.
  int find_or_note(const std::array<float, 3>& p, const std::vector<Eigen::Vector3d>& places) {
    const Eigen::Vector3f place(p[0], p[1], p[2]);
    if (!place.allFinite()) return -1;
    if (2 * (places.size() + 1) > slots_.size()) {
      rehash(std::max<size_t>(64, 2 * slots_.size()));
      for (size_t i = 0; i < places.size(); ++i)
        if (places[i].allFinite()) slots_[slot(places[i].cast<float>(), places)] = static_cast<int>(i);
    }
    int& found = slots_[slot(place, places)];
    if (found >= 0) return found;
    found = static_cast<int>(places.size());
    return -1;
  }

 private:
  void rehash(size_t count) { slots_.assign(count, -1); }
  // Where p is or would be.
  size_t slot(const Eigen::Vector3f& p, const std::vector<Eigen::Vector3d>& places) const {
    std::uint64_t h = 0;
    for (const float x : p) h = (h ^ std::bit_cast<std::uint32_t>(x)) * 0x9E3779B97F4A7C15u, h ^= h >> 29;
    const size_t mask = slots_.size() - 1;
    size_t at = static_cast<size_t>(h) & mask;
    while (slots_[at] >= 0 && places[static_cast<size_t>(slots_[at])] != p.cast<double>()) at = (at + 1) & mask;
    return at;
  }
  std::vector<int> slots_;
};

// Collects the triangles of all meshes of a scene, welding equal positions.
class Collector {
 public:
  void add(const ForeignMesh& m) {
    std::vector<int> vertex(m.positions.size());
    const int first_uv = static_cast<int>(uv_.size());
    for (size_t i = 0; i < vertex.size(); ++i) {
      vertex[i] = weld(m.positions[i], m.colours.empty() ? Eigen::Vector3d::Zero() : linear(m.colours[i]));
      uv_.push_back(m.uv.empty() ? Eigen::Vector2d::Zero() : Eigen::Vector2d(m.uv[i][0], m.uv[i][1]));
    }
    has_uv_ = has_uv_ || !m.uv.empty();
    has_colours_ = has_colours_ || !m.colours.empty();
    for (const auto& [a, b, c] : m.triangles) {
      const auto corner = [&](int i) { return vertex[static_cast<size_t>(i)]; };
      faces_.push_back({corner(a), corner(b), corner(c)});
      uv_faces_.push_back({first_uv + a, first_uv + b, first_uv + c});
      material_.push_back(m.material);
    }
  }

  void add(const Mesh& m) {
    index_.reserve(static_cast<size_t>(m.V.rows()));
    faces_.reserve(static_cast<size_t>(m.F.rows())), uv_faces_.reserve(static_cast<size_t>(m.F.rows()));
    std::vector<int> vertex(static_cast<size_t>(m.V.rows()));
    for (Eigen::Index i = 0; i < m.V.rows(); ++i) {
      const Eigen::Vector3f p = m.V.row(i).transpose().cast<float>();
      Eigen::Vector3d colour = Eigen::Vector3d::Zero();
      if (m.colours.rows() > 0) colour = m.colours.row(i).transpose();
      vertex[static_cast<size_t>(i)] = weld({p[0], p[1], p[2]}, colour);
    }
    welded_ = static_cast<int>(m.V.rows() - static_cast<Eigen::Index>(positions_.size()));
    has_colours_ = has_colours_ || m.colours.rows() > 0;
    has_uv_ = has_uv_ || m.uv.rows() > 0;
    for (Eigen::Index i = 0; i < m.uv.rows(); ++i) uv_.push_back(m.uv.row(i).transpose());
    const Faces& uv_faces = m.uv_faces.rows() > 0 ? m.uv_faces : m.F;
    for (Eigen::Index f = 0; f < m.F.rows(); ++f) {
      const auto corner = [&](int k) { return vertex[static_cast<size_t>(m.F(f, k))]; };
      faces_.push_back({corner(0), corner(1), corner(2)});
      uv_faces_.push_back({uv_faces(f, 0), uv_faces(f, 1), uv_faces(f, 2)});
    }
  }

  Mesh mesh() const {
    Mesh mesh;
    const auto n = static_cast<Eigen::Index>(positions_.size());
    mesh.V.resize(n, 3);
    for (Eigen::Index i = 0; i < n; ++i) mesh.V.row(i) = positions_[static_cast<size_t>(i)].transpose();
    mesh.F = rows(faces_);
    if (has_colours_) {
      mesh.colours.resize(n, 3);
      for (Eigen::Index i = 0; i < n; ++i) mesh.colours.row(i) = colours_[static_cast<size_t>(i)].transpose();
    }
    if (has_uv_) {
      mesh.uv.resize(static_cast<Eigen::Index>(uv_.size()), 2);
      for (size_t i = 0; i < uv_.size(); ++i) mesh.uv.row(static_cast<Eigen::Index>(i)) = uv_[i].transpose();
      mesh.uv_faces = rows(uv_faces_);
    }
    return mesh;
  }

  const std::vector<int>& material_of_triangle() const { return material_; }
  int welded() const { return welded_; }

 private:
  static Faces rows(const std::vector<std::array<int, 3>>& list) {
    Faces F(static_cast<Eigen::Index>(list.size()), 3);
    for (size_t i = 0; i < list.size(); ++i)
      for (int k = 0; k < 3; ++k) F(static_cast<Eigen::Index>(i), k) = list[i][static_cast<size_t>(k)];
    return F;
  }

  static Eigen::Vector3d linear(const std::array<float, 3>& c) {
    return {linear_from_srgb(c[0]), linear_from_srgb(c[1]), linear_from_srgb(c[2])};
  }

  int weld(std::array<float, 3> p, const Eigen::Vector3d& colour) {
    for (float& x : p)
      if (x == 0) x = 0;  // -0 and 0 are one place
    const int known = index_.find_or_note(p, positions_);
    if (known >= 0) return known;
    positions_.emplace_back(p[0], p[1], p[2]);
    colours_.push_back(colour);
    return static_cast<int>(positions_.size()) - 1;
  }

  PlaceIndex index_;
  std::vector<Eigen::Vector3d> positions_, colours_;
  std::vector<Eigen::Vector2d> uv_;
  std::vector<std::array<int, 3>> faces_, uv_faces_;
  std::vector<int> material_;
  int welded_ = 0;
  bool has_uv_ = false, has_colours_ = false;
};

// A picture that a mesh file names, looked for beside the mesh only: a path that leaves the folder is refused.
fs::path find_picture(std::string name, const fs::path& folder, std::vector<std::string>* warnings) {
  std::replace(name.begin(), name.end(), '\\', '/');
  const fs::path file = folder / name;
  if (!lies_inside(file, folder))
    warnings->push_back("texture '" + name + "' lies outside the scan's folder and was not read");
  else if (!is_file(file))
    warnings->push_back("texture '" + name + "' is missing; put it beside the scan, or the scan goes without colours");
  else
    return file;
  return {};
}

fs::path texture_of(const ForeignScene& scene, int material, const fs::path& folder,
                    std::vector<std::string>* warnings) {
  if (material < 0 || static_cast<size_t>(material) >= scene.pictures.size()) return {};
  const std::string& name = scene.pictures[static_cast<size_t>(material)];
  if (name.empty()) return {};
  if (name[0] != '*') return find_picture(name, folder, warnings);
  warnings->push_back("the texture is embedded in the file and was not read");
  return {};
}

// One path per picture index (empty: not to be had), and the picture of each triangle.
void set_textures(const std::vector<fs::path>& pictures, std::vector<int> of_triangle, ImportedMesh* result) {
  std::vector<int> renumbered, count;
  for (const fs::path& picture : pictures) {
    const auto known = std::find(result->textures.begin(), result->textures.end(), picture);
    renumbered.push_back(picture.empty() ? -1 : static_cast<int>(known - result->textures.begin()));
    if (!picture.empty() && known == result->textures.end()) result->textures.push_back(picture);
  }
  count.assign(result->textures.size(), 0);
  for (int& picture : of_triangle) {
    if (picture >= 0) picture = renumbered[static_cast<size_t>(picture)];
    if (picture >= 0) ++count[static_cast<size_t>(picture)];
  }
  if (result->textures.empty()) return;
  result->texture = result->textures[static_cast<size_t>(std::max_element(count.begin(), count.end()) - count.begin())];
  if (result->textures.size() > 1)
    result->texture_of_triangle = std::move(of_triangle);
  else
    result->textures.clear();
}

void set_textures_of_scene(const ForeignScene& scene, const Collector& collector, const fs::path& folder,
                           ImportedMesh* result) {
  std::map<int, int> place;
  std::vector<fs::path> pictures;
  std::vector<int> of_triangle;
  for (const int material : collector.material_of_triangle()) {
    const auto [at, is_new] = place.try_emplace(material, static_cast<int>(pictures.size()));
    if (is_new) pictures.push_back(texture_of(scene, material, folder, &result->warnings));
    of_triangle.push_back(at->second);
  }
  set_textures(pictures, std::move(of_triangle), result);
}

// PLY is read by libmodel/io: assimp 5.2 skips line ends after the header, of which the first bytes of binary data may
// look like some; it then reads shifted values, or its assertions end the program.
void import_ply(const fs::path& file, Collector* collector, ImportedMesh* result) {
  collector->add(parse_ply(read_file(file), file.string(), NonFinite::keep));
  if (lower_case(file.extension().string()) != ".ply") return;
  if (const auto texture = texture_file(file))
    result->texture = *texture;
  else if (const std::string name = texture_name(file); !name.empty())
    find_picture(name, file.parent_path(), &result->warnings);  // says why not
}

void import_obj(const fs::path& file, const Mesh& mesh, Collector* collector, ImportedMesh* result) {
  collector->add(mesh);
  const ObjTextures textures = read_obj_textures(file);
  result->warnings.insert(result->warnings.end(), textures.warnings.begin(), textures.warnings.end());
  std::vector<fs::path> pictures;
  for (const std::string& name : textures.pictures)
    pictures.push_back(find_picture(name, file.parent_path(), &result->warnings));
  if (static_cast<Eigen::Index>(textures.of_triangle.size()) == mesh.F.rows())
    set_textures(pictures, textures.of_triangle, result);
}

void import_with_assimp(const fs::path& file, const std::string& format, Collector* collector, ImportedMesh* result) {
  const ForeignScene scene = read_with_assimp(file, format);
  for (const ForeignMesh& mesh : scene.meshes) collector->add(mesh);
  set_textures_of_scene(scene, *collector, file.parent_path(), result);
}

// Our reader if it can, which is faster and keeps lines for its errors; assimp forgives more.
void import_obj_or_ask_assimp(const fs::path& file, Collector* collector, ImportedMesh* result) {
  std::optional<Mesh> mesh;
  std::string refusal;
  try {
    mesh = parse_obj(read_file(file), file.string());
  } catch (const IoError& error) {
    refusal = error.what();
  }
  if (mesh) return import_obj(file, *mesh, collector, result);
  try {
    import_with_assimp(file, ".obj", collector, result);
  } catch (const IoError&) {
    throw IoError(file.string(), "cannot be read as a mesh: " + refusal);
  }
  result->warnings.push_back("not quite an OBJ file (" + refusal + "); what could be read was used");
}

// Leaves out the triangles with a corner that is nowhere.
void drop_non_finite(ImportedMesh* result) {
  Mesh& mesh = result->mesh;
  Eigen::Index kept = 0;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    bool finite = true;
    for (int k = 0; k < 3; ++k) finite = finite && mesh.V.row(mesh.F(f, k)).allFinite();
    if (!finite) continue;
    mesh.F.row(kept) = mesh.F.row(f);
    if (mesh.uv_faces.rows() > 0) mesh.uv_faces.row(kept) = mesh.uv_faces.row(f);
    if (!result->texture_of_triangle.empty())
      result->texture_of_triangle[static_cast<size_t>(kept)] = result->texture_of_triangle[static_cast<size_t>(f)];
    ++kept;
  }
  result->non_finite_triangles = static_cast<int>(mesh.F.rows() - kept);
  mesh.F.conservativeResize(kept, 3);
  if (mesh.uv_faces.rows() > 0) mesh.uv_faces.conservativeResize(kept, 3);
  if (!result->texture_of_triangle.empty()) result->texture_of_triangle.resize(static_cast<size_t>(kept));
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i)
    if (!mesh.V.row(i).allFinite()) mesh.V.row(i).setZero();
  result->warnings.push_back("some vertices are not finite numbers; " + std::to_string(result->non_finite_triangles) +
                             " triangles that use them were left out");
}

}  // namespace

const std::vector<std::string>& mesh_extensions() {
  static const std::vector<std::string> list = {".obj", ".ply", ".stl", ".off", ".gltf", ".glb",
                                                ".dae", ".fbx", ".3ds", ".x",   ".wrl"};
  return list;
}

ImportedMesh import_mesh(const fs::path& file) {
  std::error_code error;
  const auto bytes = fs::file_size(file, error);
  if (error) throw IoError(file.string(), "cannot be opened: " + error.message());
  if (bytes == 0) throw IoError(file.string(), "the file is empty");
  if (bytes > (std::uintmax_t{1} << 32)) throw IoError(file.string(), "larger than 4 GiB, which no face scan is");
  Collector collector;
  ImportedMesh result;
  const std::string extension = lower_case(file.extension().string()), content = mesh_format_by_content(file);
  const std::string format = content.empty() ? extension : content;
  if (format != extension)
    result.warnings.push_back("the file is called " + extension + " but holds " + format.substr(1) + "; read as that");
  if (format == ".ply")
    import_ply(file, &collector, &result);
  else if (format == ".obj")
    import_obj_or_ask_assimp(file, &collector, &result);
  else
    import_with_assimp(file, format, &collector, &result);
  result.mesh = collector.mesh();
  result.welded_vertices = collector.welded();
  if (!result.mesh.V.allFinite()) drop_non_finite(&result);
  if (result.mesh.F.rows() == 0)
    throw IoError(file.string(),
                  "holds no triangles; point clouds must be meshed first (Poisson reconstruction, for instance)");
  return result;
}

}  // namespace facewright
