// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/assimp_reader.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cstdint>
#include <cstring>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/guarded_call.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

// The scene as bytes: each list is its length (64 bit) and its items.
class SceneWriter {
 public:
  template <class T>
  void list(const T* items, size_t count) {
    const std::uint64_t n = count;
    out_.append(reinterpret_cast<const char*>(&n), sizeof n);
    if (n > 0) out_.append(reinterpret_cast<const char*>(items), count * sizeof(T));
  }
  template <class List>
  void list(const List& items) {
    list(items.data(), items.size());
  }
  std::string take() { return std::move(out_); }

 private:
  std::string out_;
};

// Nothing that comes from a process which may have gone astray is believed.
class SceneReader {
 public:
  explicit SceneReader(const std::string& bytes) : bytes_(bytes) {}

  template <class List>
  List list() {
    std::uint64_t n = 0;
    take(&n, sizeof n);
    if (n > (bytes_.size() - at_) / sizeof(typename List::value_type)) fail();
    List items;
    items.resize(static_cast<size_t>(n));
    take(items.data(), items.size() * sizeof(typename List::value_type));
    return items;
  }
  bool at_end() const { return at_ == bytes_.size(); }
  [[noreturn]] static void fail() { throw InvalidInput("crashed"); }

 private:
  void take(void* to, size_t size) {
    if (size > bytes_.size() - at_) fail();
    if (size > 0) std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
  }
  const std::string& bytes_;
  size_t at_ = 0;
};

ForeignMesh plain(const aiMesh& m, const aiMatrix4x4& transform) {
  ForeignMesh mesh;
  mesh.material = static_cast<int>(m.mMaterialIndex);
  for (unsigned i = 0; i < m.mNumVertices; ++i) {
    const aiVector3D p = transform * m.mVertices[i];
    mesh.positions.push_back({p.x, p.y, p.z});
    if (m.HasVertexColors(0)) mesh.colours.push_back({m.mColors[0][i].r, m.mColors[0][i].g, m.mColors[0][i].b});
    if (m.HasTextureCoords(0)) mesh.uv.push_back({m.mTextureCoords[0][i].x, m.mTextureCoords[0][i].y});
  }
  for (unsigned f = 0; f < m.mNumFaces; ++f) {
    const unsigned* i = m.mFaces[f].mIndices;
    if (m.mFaces[f].mNumIndices == 3)
      mesh.triangles.push_back({static_cast<int>(i[0]), static_cast<int>(i[1]), static_cast<int>(i[2])});
  }
  return mesh;
}

void write(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, SceneWriter* out) {
  const aiMatrix4x4 transform = parent * node.mTransformation;
  for (unsigned i = 0; i < node.mNumMeshes; ++i) {
    const ForeignMesh mesh = plain(*scene.mMeshes[node.mMeshes[i]], transform);
    out->list(&mesh.material, 1);
    out->list(mesh.positions), out->list(mesh.colours), out->list(mesh.uv), out->list(mesh.triangles);
  }
  for (unsigned i = 0; i < node.mNumChildren; ++i) write(scene, *node.mChildren[i], transform, out);
}

std::string picture_of(const aiMaterial& m) {
  aiString name;
  const bool found = m.GetTexture(aiTextureType_DIFFUSE, 0, &name) == AI_SUCCESS ||
                     m.GetTexture(aiTextureType_BASE_COLOR, 0, &name) == AI_SUCCESS;
  return found ? name.C_Str() : "";
}

std::string why_not(const std::string& assimp_error) {
  if (assimp_error.find("bad_alloc") == assimp_error.npos && assimp_error.find("length_error") == assimp_error.npos)
    return assimp_error;
  return "it says it is larger than memory holds; it is damaged or cut short: export the scan again";
}

bool is_called(const fs::path& file, const std::string& format) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension == format;
}

std::string scene_bytes(const fs::path& file, const std::string& format) {
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  // JoinIdenticalVertices undoes assimp's one-vertex-per-corner reading of OBJ; SortByPType drops points and lines.
  const unsigned steps = aiProcess_Triangulate | aiProcess_JoinIdenticalVertices | aiProcess_SortByPType;
  const aiScene* scene = nullptr;
  if (is_called(file, format)) {
    scene = importer.ReadFile(file.string(), steps);
  } else {  // called something else than it is
    const std::string bytes = read_file(file);
    scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), steps, format.c_str() + 1);
  }
  if (!scene || !scene->mRootNode) throw InvalidInput(why_not(importer.GetErrorString()));
  SceneWriter out;
  std::string names;
  for (unsigned i = 0; i < scene->mNumMaterials; ++i) names += picture_of(*scene->mMaterials[i]) + '\n';
  out.list(names);
  write(*scene, *scene->mRootNode, aiMatrix4x4(), &out);
  return out.take();
}

ForeignMesh read_mesh_of(SceneReader& in) {
  ForeignMesh mesh;
  const auto material = in.list<std::vector<int>>();
  if (material.size() != 1) SceneReader::fail();
  mesh.material = material[0];
  mesh.positions = in.list<decltype(mesh.positions)>();
  mesh.colours = in.list<decltype(mesh.colours)>();
  mesh.uv = in.list<decltype(mesh.uv)>();
  mesh.triangles = in.list<decltype(mesh.triangles)>();
  const size_t n = mesh.positions.size();
  if ((!mesh.colours.empty() && mesh.colours.size() != n) || (!mesh.uv.empty() && mesh.uv.size() != n))
    SceneReader::fail();
  for (const auto& triangle : mesh.triangles)
    for (const int i : triangle)
      if (i < 0 || static_cast<size_t>(i) >= n) SceneReader::fail();
  return mesh;
}

ForeignScene scene_from(const std::string& bytes) {
  ForeignScene scene;
  SceneReader in(bytes);
  const auto names = in.list<std::string>();
  for (size_t at = 0; at < names.size();) {
    const size_t end = std::min(names.find('\n', at), names.size());
    scene.pictures.push_back(names.substr(at, end - at));
    at = end + 1;
  }
  while (!in.at_end()) scene.meshes.push_back(read_mesh_of(in));
  return scene;
}

}  // namespace

ForeignScene read_with_assimp(const fs::path& file, const std::string& format) {
  constexpr std::uint64_t kRoom = std::uint64_t{1} << 30, kRoomPerByte = 100, kBytesPerSecond = 1 << 20;
  const std::uint64_t size = fs::file_size(file);
  const GuardLimits limits{kRoom + kRoomPerByte * size, 5 + static_cast<int>(size / kBytesPerSecond)};
  try {
    return scene_from(guarded_call([&] { return scene_bytes(file, format); }, limits));
  } catch (const InvalidInput& error) {
    const std::string why = error.what();
    if (why == "crashed" || why.starts_with("took longer") || why.starts_with("needs more memory"))
      throw IoError(file.string(), "cannot be read as a mesh: the reader of " + format + " files " + why +
                                       "; it is damaged or cut short: export the scan again");
    throw IoError(file.string(), "cannot be read as a mesh: " + why);
  }
}

}  // namespace facewright
