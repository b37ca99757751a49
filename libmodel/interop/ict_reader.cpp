// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>

#include "libmodel/core/errors.h"
#include "libmodel/interop/foreign_model.h"
#include "libmodel/io/mesh_files.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNeutral = "generic_neutral_mesh.obj";

std::vector<fs::path> shape_files(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().extension() == ".obj" && entry.path().filename() != kNeutral)
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

bool is_identity(const fs::path& file) {
  const std::string stem = file.stem().string();
  return stem.starts_with("identity") && stem.size() > 8 && stem.find_first_not_of("0123456789", 8) == stem.npos;
}

Vertices read_step(const fs::path& file, const Mesh& neutral) {
  const Mesh mesh = read_mesh(file);
  if (mesh.V.rows() != neutral.V.rows())
    throw IoError(file.string(), "has " + std::to_string(mesh.V.rows()) + " vertices; " + kNeutral + " has " +
                                     std::to_string(neutral.V.rows()));
  if (mesh.F.rows() > 0 && (mesh.F.rows() != neutral.F.rows() || mesh.F != neutral.F))
    throw IoError(file.string(), std::string("has other polygons than ") + kNeutral);
  return mesh.V - neutral.V;
}

// One coordinate per vertex where no vertex has two; seams cannot be kept.
void take_texture(const Mesh& neutral, ForeignModel& model) {
  if (!neutral.has_uv()) return;
  TexCoords uv = TexCoords::Constant(neutral.V.rows(), 2, -1);
  if (neutral.uv_faces.rows() == 0) uv = neutral.uv;
  for (Eigen::Index f = 0; f < neutral.uv_faces.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      auto row = uv.row(neutral.F(f, k));
      const auto corner = neutral.uv.row(neutral.uv_faces(f, k));
      if (row[0] != -1 && (row - corner).cwiseAbs().maxCoeff() > 1e-6) {
        model.notes.push_back("texture coordinates: left out, vertices on seams have several");
        return;
      }
      row = corner;
    }
  model.uv = uv.cwiseMax(0);
}

}  // namespace

ForeignModel read_ict_folder(const fs::path& folder) {
  if (!fs::exists(folder / kNeutral))
    throw IoError(folder.string(), std::string("holds no ") + kNeutral + "; name the folder with ICT-FaceKit's meshes");
  ForeignModel model;
  model.path = folder.string();
  model.format = "ICT-FaceKit (folder of OBJ)";
  const Mesh neutral = read_mesh(folder / kNeutral);
  const std::vector<fs::path> files = shape_files(folder);
  model.shape.mean = as_vector(neutral.V);
  model.shape.scale = ModeScale::columns;
  model.shape.columns.resize(neutral.V.size(), std::count_if(files.begin(), files.end(), is_identity));
  Eigen::Index k = 0;
  for (const fs::path& file : files) {
    const Eigen::VectorXd step = as_vector(read_step(file, neutral));
    if (is_identity(file))
      model.shape.columns.col(k++) = step;
    else
      model.blendshapes.push_back({file.stem().string(), step});
  }
  model.F = neutral.F;
  take_texture(neutral, model);
  model.units = "cm";
  model.notes.push_back("modes: " + std::to_string(k) + " files identityNNN.obj, each one standard deviation from " +
                        kNeutral + "; " + std::to_string(model.blendshapes.size()) +
                        " other files are blendshapes by their names");
  model.notes.push_back("quads are cut into triangles from their first corner");
  return model;
}

}  // namespace facewright
