// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <iostream>
#include <nlohmann/json.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/surface/compare.h"
#include "tools/cli.h"

using namespace facewright;
using nlohmann::json;

namespace {

// {"31": vertex, ...} -> positions on the mesh.
Landmarks landmarks_at_vertices(const std::string& path, const Mesh& mesh) {
  Landmarks landmarks;
  const json vertices = json::parse(read_file(path), nullptr, /*allow_exceptions=*/false);
  if (!vertices.is_object()) throw IoError(path, "expected a JSON object of vertex numbers, like {\"31\": 17}");
  for (const auto& [name, value] : vertices.items()) {
    if (!value.is_number_integer()) throw IoError(path, "landmark " + name + " is not a vertex number");
    const auto vertex = value.get<Eigen::Index>();
    if (vertex >= 0 && vertex < mesh.V.rows()) landmarks[name].position = mesh.V.row(vertex).transpose();
  }
  return landmarks;
}

Similarity align_landmarks(const Landmarks& a, const Landmarks& b, Scaling scaling) {
  const std::vector<std::string> names = common_names(a, b);
  const auto count = static_cast<Eigen::Index>(names.size());
  Vertices A(count, 3), B(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    A.row(i) = a.at(names[static_cast<size_t>(i)]).position.transpose();
    B.row(i) = b.at(names[static_cast<size_t>(i)]).position.transpose();
  }
  return fit_similarity(A, B, scaling);
}

json summary_json(const CompareResult& result) {
  const CompareSummary& s = result.summary;
  return {{"mean_mm", s.mean},
          {"rms_mm", s.rms},
          {"median_mm", s.median},
          {"p95_mm", s.p95},
          {"max_mm", s.max},
          {"compared_vertices", s.compared},
          {"vertices", result.distances.size()},
          {"scale", result.target_from_source.s},
          {"iterations", s.iterations},
          {"converged", s.converged}};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Distances of the vertices of mesh A to the surface of mesh B, after aligning A to B; prints JSON.\n"
      "Vertices whose nearest place is the border of B (a hole, the end of a scan) are left out.",
      "compare-meshes");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::jobs,
                     "compare-meshes fit/mesh.ply scans/p01.ply --align similarity --vertices-a landmark_vertices.json "
                     "--landmarks-b scans/p01.json");
  std::string a_path, b_path, landmarks_a, vertices_a, landmarks_b;
  SurfaceAlignment alignment = SurfaceAlignment::rigid;
  app.add_option("a", a_path, "Mesh whose vertices are measured (.ply, .obj)")->required()->check(CLI::ExistingFile);
  app.add_option("b", b_path, "Mesh they are measured against")->required()->check(CLI::ExistingFile);
  const std::map<std::string, SurfaceAlignment> alignments = {{"none", SurfaceAlignment::none},
                                                              {"rigid", SurfaceAlignment::rigid},
                                                              {"similarity", SurfaceAlignment::similarity}};
  app.add_option("--align", alignment, "none, rigid (the default) or similarity")
      ->transform(CLI::CheckedTransformer(alignments).description("{none,rigid,similarity}"))
      ->default_str("rigid");
  auto* positions =
      app.add_option("--landmarks-a", landmarks_a, "Landmarks of A to start from")->check(CLI::ExistingFile);
  app.add_option("--vertices-a", vertices_a, "The same as vertex numbers: {\"31\": 17, ...}")
      ->check(CLI::ExistingFile)
      ->excludes(positions);
  app.add_option("--landmarks-b", landmarks_b, "Landmarks of B, same names")->check(CLI::ExistingFile);

  return run_program(argc, argv, app, common, [&] {
    const bool marked_a = !landmarks_a.empty() || !vertices_a.empty();
    if (marked_a == landmarks_b.empty())
      throw CLI::ValidationError(
          "landmarks are needed for both meshes or for none (--landmarks-a or --vertices-a, and "
          "--landmarks-b)");
    const Mesh a = read_mesh(a_path), b = read_mesh(b_path);
    CompareOptions options;
    options.alignment = alignment;
    options.threads = common.jobs;
    if (marked_a) {
      const Landmarks marks = vertices_a.empty() ? read_landmarks(landmarks_a) : landmarks_at_vertices(vertices_a, a);
      options.start = align_landmarks(marks, read_landmarks(landmarks_b),
                                      alignment == SurfaceAlignment::similarity ? Scaling::free : Scaling::fixed);
    }
    std::cout << summary_json(compare_surfaces(a, b, options)).dump(2) << std::endl;
    return ExitCode::ok;
  });
}
