// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/mesh_import.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <unordered_map>

#include "libmodel/core/errors.h"
#include "libmodel/io/mesh_files.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

struct PositionHash {
  size_t operator()(const std::array<float, 3>& p) const {
    size_t h = 1469598103934665603ULL;
    for (const float x : p) h = (h ^ std::hash<float>{}(x)) * 1099511628211ULL;
    return h;
  }
};

// Collects the triangles of all meshes of a scene, welding equal positions.
class Collector {
 public:
  void add(const aiMesh& m, const aiMatrix4x4& transform) {
    std::vector<int> vertex(m.mNumVertices), coordinate(m.mNumVertices);
    for (unsigned i = 0; i < m.mNumVertices; ++i) {
      const aiVector3D p = transform * m.mVertices[i];
      vertex[i] = weld({p.x, p.y, p.z}, m.HasVertexColors(0) ? linear(m.mColors[0][i]) : Eigen::Vector3d::Zero());
      coordinate[i] = static_cast<int>(uv_.size());
      uv_.push_back(m.HasTextureCoords(0) ? Eigen::Vector2d(m.mTextureCoords[0][i].x, m.mTextureCoords[0][i].y)
                                          : Eigen::Vector2d::Zero());
    }
    has_uv_ = has_uv_ || m.HasTextureCoords(0);
    has_colours_ = has_colours_ || m.HasVertexColors(0);
    for (unsigned f = 0; f < m.mNumFaces; ++f) {
      if (m.mFaces[f].mNumIndices != 3) continue;
      const unsigned* i = m.mFaces[f].mIndices;
      faces_.push_back({vertex[i[0]], vertex[i[1]], vertex[i[2]]});
      uv_faces_.push_back({coordinate[i[0]], coordinate[i[1]], coordinate[i[2]]});
    }
    triangles_of_material_[m.mMaterialIndex] += static_cast<int>(m.mNumFaces);
  }

  void add(const Mesh& m) {
    std::vector<int> vertex(static_cast<size_t>(m.V.rows()));
    for (Eigen::Index i = 0; i < m.V.rows(); ++i) {
      const Eigen::Vector3f p = m.V.row(i).transpose().cast<float>();
      Eigen::Vector3d colour = Eigen::Vector3d::Zero();
      if (m.colours.rows() > 0) colour = m.colours.row(i).transpose();
      vertex[static_cast<size_t>(i)] = weld({p[0], p[1], p[2]}, colour);
    }
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

  const std::map<unsigned, int>& triangles_of_material() const { return triangles_of_material_; }

 private:
  static Faces rows(const std::vector<std::array<int, 3>>& list) {
    Faces F(static_cast<Eigen::Index>(list.size()), 3);
    for (size_t i = 0; i < list.size(); ++i)
      for (int k = 0; k < 3; ++k) F(static_cast<Eigen::Index>(i), k) = list[i][static_cast<size_t>(k)];
    return F;
  }

  static Eigen::Vector3d linear(const aiColor4D& c) {
    return {linear_from_srgb(c.r), linear_from_srgb(c.g), linear_from_srgb(c.b)};
  }

  int weld(const std::array<float, 3>& p, const Eigen::Vector3d& colour) {
    const auto [it, is_new] = index_.try_emplace(p, static_cast<int>(positions_.size()));
    if (is_new) {
      positions_.emplace_back(p[0], p[1], p[2]);
      colours_.push_back(colour);
    }
    return it->second;
  }

  std::unordered_map<std::array<float, 3>, int, PositionHash> index_;
  std::vector<Eigen::Vector3d> positions_, colours_;
  std::vector<Eigen::Vector2d> uv_;
  std::vector<std::array<int, 3>> faces_, uv_faces_;
  std::map<unsigned, int> triangles_of_material_;
  bool has_uv_ = false, has_colours_ = false;
};

void walk(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, Collector* collector) {
  const aiMatrix4x4 transform = parent * node.mTransformation;
  for (unsigned i = 0; i < node.mNumMeshes; ++i) collector->add(*scene.mMeshes[node.mMeshes[i]], transform);
  for (unsigned i = 0; i < node.mNumChildren; ++i) walk(scene, *node.mChildren[i], transform, collector);
}

bool is_inside(const fs::path& file, const fs::path& folder) {
  const fs::path relative = fs::weakly_canonical(file).lexically_relative(fs::weakly_canonical(folder));
  return !relative.empty() && *relative.begin() != "..";
}

// The image of one material, looked for beside the mesh only: a path that leaves the folder is refused.
fs::path texture_of(const aiScene& scene, unsigned material, const fs::path& folder,
                    std::vector<std::string>* warnings) {
  aiString name;
  if (material >= scene.mNumMaterials) return {};
  const aiMaterial& m = *scene.mMaterials[material];
  if (m.GetTexture(aiTextureType_DIFFUSE, 0, &name) != AI_SUCCESS &&
      m.GetTexture(aiTextureType_BASE_COLOR, 0, &name) != AI_SUCCESS)
    return {};
  std::string text = name.C_Str();
  std::replace(text.begin(), text.end(), '\\', '/');
  if (text.starts_with("*")) {
    warnings->push_back("the texture is embedded in the file and was not read");
    return {};
  }
  const fs::path file = folder / text;
  if (!is_inside(file, folder))
    warnings->push_back("texture '" + text + "' lies outside the scan's folder and was not read");
  else if (!fs::exists(file))
    warnings->push_back("texture '" + text + "' is missing");
  else
    return file;
  return {};
}

fs::path main_texture(const aiScene& scene, const Collector& collector, const fs::path& folder,
                      std::vector<std::string>* warnings) {
  int most = 0, with_texture = 0;
  fs::path best;
  for (const auto& [material, count] : collector.triangles_of_material()) {
    const fs::path texture = texture_of(scene, material, folder, warnings);
    if (texture.empty()) continue;
    ++with_texture;
    if (count > most) best = texture, most = count;
  }
  if (with_texture > 1)
    warnings->push_back("the scan has " + std::to_string(with_texture) + " textures; only the largest part's was used");
  return best;
}

std::string why_not(const std::string& assimp_error) {
  if (assimp_error.find("bad_alloc") == assimp_error.npos && assimp_error.find("length_error") == assimp_error.npos)
    return assimp_error;
  return "it says it is larger than memory holds; it is damaged or cut short: export the scan again";
}

// PLY is read by libmodel/io: assimp 5.2 skips line ends after the header, of which the first bytes of binary data may
// look like some; it then reads shifted values, or its assertions end the program.
void import_ply(const fs::path& file, Collector* collector, ImportedMesh* result) {
  collector->add(read_mesh(file));
  const std::optional<fs::path> texture = texture_file(file);
  if (texture && is_inside(*texture, file.parent_path()))
    result->texture = *texture;
  else if (texture)
    result->warnings.push_back("texture '" + texture->string() + "' lies outside the scan's folder and was not read");
}

void import_with_assimp(const fs::path& file, Collector* collector, ImportedMesh* result) {
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  // JoinIdenticalVertices undoes assimp's one-vertex-per-corner reading of OBJ; SortByPType drops points and lines.
  const aiScene* scene =
      importer.ReadFile(file.string(), aiProcess_Triangulate | aiProcess_JoinIdenticalVertices | aiProcess_SortByPType);
  if (!scene || !scene->mRootNode)
    throw IoError(file.string(), "cannot be read as a mesh: " + why_not(importer.GetErrorString()));
  walk(*scene, *scene->mRootNode, aiMatrix4x4(), collector);
  result->texture = main_texture(*scene, *collector, file.parent_path(), &result->warnings);
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
  if (lower_case(file.extension().string()) == ".ply")
    import_ply(file, &collector, &result);
  else
    import_with_assimp(file, &collector, &result);
  result.mesh = collector.mesh();
  if (result.mesh.F.rows() == 0)
    throw IoError(file.string(),
                  "holds no triangles; point clouds must be meshed first (Poisson reconstruction, for instance)");
  if (!result.mesh.V.allFinite()) throw IoError(file.string(), "a vertex position is not a finite number");
  return result;
}

}  // namespace facewright
