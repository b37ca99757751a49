// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/evaluation_set.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "libmodel/building/fill_unseen.h"
#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/geometry/normals.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"
#include "pipelines/output_tree.h"
#include "pipelines/registration_report.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> mesh_files(const fs::path& folder) {
  if (!fs::is_directory(folder)) throw IoError(folder.string(), "is not a folder");
  std::vector<fs::path> files;
  std::set<std::string> stems;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".ply" && extension != ".obj") continue;
    if (!stems.insert(entry.path().stem().string()).second)
      throw InvalidInput(folder.string() + ": there are two meshes called " + entry.path().stem().string());
    files.push_back(entry.path());
  }
  if (files.empty())
    throw InvalidInput(
        folder.string() +
        ": no meshes (.ply, .obj); expected a folder that build-model wrote, or meshes in correspondence");
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<Mesh> read_meshes(const std::vector<fs::path>& files, int threads) {
  std::vector<Mesh> meshes(files.size());
  parallel_for(static_cast<int>(files.size()), threads, [&](int i) {
    const auto k = static_cast<size_t>(i);
    meshes[k] = read_mesh(files[k]);
  });
  const Mesh& first = meshes.front();
  for (size_t i = 0; i < meshes.size(); ++i) {
    const std::string name = files[i].string(), than = files.front().string();
    if (meshes[i].V.rows() != first.V.rows())
      throw InvalidInput(name + ": " + std::to_string(meshes[i].V.rows()) + " vertices, " + than + " has " +
                         std::to_string(first.V.rows()) + "; the meshes must be in correspondence");
    if (meshes[i].F != first.F) throw InvalidInput(name + ": other triangles than " + than);
    if (meshes[i].V.rows() < 3 || meshes[i].F.rows() == 0) throw InvalidInput(name + ": has no surface");
    if (!meshes[i].V.allFinite()) throw InvalidInput(name + ": holds NaN or infinity");
  }
  return meshes;
}

SampleMatrix stacked(const std::vector<Mesh>& meshes, Vertices Mesh::*field, Eigen::Index vertices) {
  SampleMatrix X(static_cast<Eigen::Index>(meshes.size()), 3 * vertices);
  for (size_t i = 0; i < meshes.size(); ++i)
    X.row(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::RowVectorXd>((meshes[i].*field).data(), 3 * vertices);
  return X;
}

std::vector<int> landmark_vertices(const fs::path& file, Eigen::Index vertices) {
  std::vector<int> list;
  const auto marks = nlohmann::json::parse(read_file(file), nullptr, /*allow_exceptions=*/false);
  if (!marks.is_object()) throw IoError(file.string(), "expected a JSON object of vertex numbers, like {\"31\": 17}");
  for (const auto& [name, vertex] : marks.items()) {
    if (!vertex.is_number_integer() || vertex.get<long long>() < 0)
      throw IoError(file.string(), "landmark " + name + " is not a vertex number");
    if (vertex.get<long long>() < vertices) list.push_back(vertex.get<int>());
  }
  return list;
}

// How far the colour of each vertex of each scan can be trusted; empty where the build did not say.
SampleMatrix read_weights(const std::vector<std::string>& ids, const OutputTree& tree, Eigen::Index finest,
                          Eigen::Index vertices) {
  SampleMatrix weights(static_cast<Eigen::Index>(ids.size()), vertices);
  for (size_t s = 0; s < ids.size(); ++s) {
    const fs::path file = tree.colour_weights(ids[s]);
    if (!fs::exists(file)) return {};
    weights.row(static_cast<Eigen::Index>(s)) = read_colour_weights(file, finest).head(vertices).transpose();
  }
  return weights;
}

void read_truth(const EvaluationSetOptions& options, Eigen::Index finest, EvaluationSet& set) {
  std::vector<fs::path> files;
  for (const std::string& id : set.ids) {
    files.push_back(options.truth / (id + ".ply"));
    if (!fs::exists(files.back())) files.back().replace_extension(".obj");
    if (!fs::exists(files.back()))
      throw InvalidInput(options.truth.string() + ": there is no " + id + ".ply or .obj, which the set has");
  }
  const std::vector<Mesh> meshes = read_meshes(files, options.threads);
  if (meshes.front().V.rows() != finest)
    throw InvalidInput(files.front().string() + ": " + std::to_string(meshes.front().V.rows()) +
                       " vertices, the set has " + std::to_string(finest));
  set.shapes.targets = stacked(meshes, &Mesh::V, set.shapes.samples.cols() / 3);
}

void set_weights(const std::optional<MorphableModel>& model, int level, double rim_weight, MetricsInput& shapes) {
  shapes.distance_weights = vertex_areas(shapes.reference, shapes.F);
  shapes.alignment_weights = shapes.distance_weights;
  if (!model) return;
  const auto regions = model->regions(level);
  const auto rim = regions.find("rim");
  if (rim == regions.end()) return;
  for (const int v : rim->second) shapes.alignment_weights[v] *= rim_weight;
}

// Weights of the colours' vertices; entries nobody saw are filled in.
void finish_colours(EvaluationSet& set, int threads) {
  MetricsInput& colours = set.colours;
  colours.distance_weights = set.shapes.distance_weights;
  if (colours.visibility.size() > 0)
    colours.samples = fill_unseen(std::move(colours.samples), colours.visibility, set.shapes.reference, set.shapes.F,
                                  {.threads = threads})
                          .values;
}

}  // namespace

EvaluationSet read_evaluation_set(const EvaluationSetOptions& options) {
  const OutputTree tree{options.folder};
  const bool build = !options.registered && fs::is_directory(options.folder / "registered");
  const fs::path folder = build ? options.folder / "registered" : options.folder;
  EvaluationSet set;
  const std::vector<fs::path> files = mesh_files(folder);
  for (const fs::path& file : files) set.ids.push_back(file.stem().string());
  std::vector<Mesh> meshes = read_meshes(files, options.threads);
  const Eigen::Index finest = meshes.front().V.rows();

  std::optional<MorphableModel> model;
  if (build && fs::exists(tree.model())) {
    try_model_file(tree.model());
    model = load_model(tree.model());
  }
  set.has_model = model.has_value();
  if (model && model->vertex_count() != finest)
    throw InvalidInput(tree.model().string() + ": " + std::to_string(model->vertex_count()) + " vertices, " +
                       files.front().string() + " has " + std::to_string(finest));
  if (options.level >= 0 && !model)
    throw InvalidInput("--level needs a model.h5 in " + options.folder.string() + ", which names the levels");
  int level = -1;
  if (model) level = options.level < model->level_count() ? options.level : model->level_with(options.level);
  if (model && level < 0) level = model->level_count() - 1;

  MetricsInput& shapes = set.shapes;
  const Eigen::Index N = model ? model->vertex_count(level) : finest;
  shapes.F = model ? model->faces(level) : meshes.front().F;
  shapes.reference = model ? as_vertices(model->shape().mean).topRows(N).eval() : meshes.front().V;
  shapes.samples = stacked(meshes, &Mesh::V, N);
  set_weights(model, level, options.rim_weight, shapes);
  if (fs::exists(folder / "landmark_vertices.json"))
    shapes.landmarks = landmark_vertices(folder / "landmark_vertices.json", N);
  else if (model)
    for (const auto& [name, mark] : model->landmarks()) shapes.landmarks.push_back(mark.vertex);
  if (!options.truth.empty()) read_truth(options, finest, set);

  std::vector<Mesh> coloured;
  std::vector<std::string> coloured_ids;
  for (size_t i = 0; i < meshes.size(); ++i)
    if (meshes[i].has_colours()) coloured.push_back(std::move(meshes[i])), coloured_ids.push_back(set.ids[i]);
  if (options.colours && !coloured.empty()) {
    set.colours.samples = stacked(coloured, &Mesh::colours, N);
    if (build) set.colours.visibility = read_weights(coloured_ids, tree, finest, N);
    finish_colours(set, options.threads);
  }
  return set;
}

EvaluationSet evaluation_set(const RegisteredSet& scans, const MorphableModel& model, int level,
                             const EvaluationSetOptions& options) {
  if (scans.vertex_count() != model.vertex_count())
    throw InvalidInput("evaluation: the scans have " + std::to_string(scans.vertex_count()) + " vertices, the model " +
                       std::to_string(model.vertex_count()));
  EvaluationSet set;
  set.ids = scans.ids;
  set.has_model = true;
  const Eigen::Index N = model.vertex_count(level);
  set.shapes.F = model.faces(level);
  set.shapes.reference = as_vertices(model.shape().mean).topRows(N);
  set.shapes.samples = scans.shapes.leftCols(3 * N);
  set_weights(model, level, options.rim_weight, set.shapes);
  for (const auto& [name, mark] : model.landmarks()) set.shapes.landmarks.push_back(mark.vertex);
  if (!options.colours || scans.colours.size() == 0) return set;
  std::vector<Eigen::Index> coloured;
  for (Eigen::Index s = 0; s < scans.scan_count(); ++s)
    if (scans.colour_weights.size() == 0 || scans.colour_weights.row(s).maxCoeff() > 0) coloured.push_back(s);
  set.colours.samples = scans.colours(coloured, Eigen::seqN(0, 3 * N));
  if (scans.colour_weights.size() > 0) set.colours.visibility = scans.colour_weights(coloured, Eigen::seqN(0, N));
  finish_colours(set, options.threads);
  return set;
}

}  // namespace facewright
