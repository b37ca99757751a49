// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// How far faces deviate from the levels that each criterion makes: decided on one folder of scans, measured on another.
//   level_tables DECIDE TEST [THREADS]
#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "libmodel/core/parallel.h"
#include "libmodel/core/topology.h"
#include "libmodel/surface/nearest.h"
#include "libregister/registration/register_scan.h"
#include "libregister/subdivision/deviation.h"
#include "pipelines/level_decision.h"

namespace facewright {
namespace {

// Registered on the uniform mesh of 54208 vertices, with the usual schedule.
std::vector<Vertices> registered(const std::filesystem::path& folder, const MultiresTemplate& uniform, int threads) {
  const auto files = find_scans(folder);
  std::vector<Vertices> faces(files.size());
  parallel_for(static_cast<int>(files.size()), threads, [&](int i) {
    const auto s = static_cast<size_t>(i);
    const Scan scan = load_scan(files[s]);
    const RegistrationResult r = register_scan(scan.mesh, scan.landmarks, uniform);
    if (r.summary.acceptable) faces[s] = r.V;
  });
  std::erase_if(faces, [](const Vertices& V) { return V.rows() == 0; });
  return faces;
}

Eigen::VectorXd vertex_areas(const Vertices& V, const Faces& F) {
  Eigen::VectorXd areas = Eigen::VectorXd::Zero(V.rows());
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const Eigen::Vector3d a = V.row(F(f, 1)) - V.row(F(f, 0)), b = V.row(F(f, 2)) - V.row(F(f, 0));
    for (int k = 0; k < 3; ++k) areas[F(f, k)] += a.cross(b).norm() / 6;
  }
  return areas;
}

// Squared distances of the uniform mesh's vertices from a level whose own vertices are taken from it.
Eigen::VectorXd squared_distances(const Vertices& face, const MultiresTemplate& t, size_t level,
                                  const std::vector<int>& uniform_vertex) {
  Vertices V(t.levels[level].vertex_count, 3);
  for (Eigen::Index v = 0; v < V.rows(); ++v) {
    const int u = uniform_vertex[static_cast<size_t>(v)];
    if (u >= 0) {
      V.row(v) = face.row(u);
    } else {
      const VertexParents& p = t.parents[static_cast<size_t>(v - t.base_count())];
      V.row(v) = 0.5 * (V.row(p.a) + V.row(p.b));
    }
  }
  const SurfaceIndex surface(V, t.levels[level].F);
  Eigen::VectorXd d(face.rows());
  for (Eigen::Index i = 0; i < d.size(); ++i)
    d[i] = std::pow(surface.nearest(face.row(i).transpose().eval()).distance, 2);
  return d;
}

void print_level(const char* name, const MultiresTemplate& t, size_t level, const DeviationTable& table,
                 const std::vector<Vertices>& faces, const Faces& uniform_faces, int threads) {
  std::vector<int> uniform_vertex;
  int beyond = 0;
  for (int v = 0; v < t.levels[level].vertex_count; ++v) {
    const VertexParents p = v < t.base_count() ? VertexParents{} : t.parents[static_cast<size_t>(v - t.base_count())];
    const auto at = [&](int x) { return x < 0 ? -1 : uniform_vertex[static_cast<size_t>(x)]; };
    uniform_vertex.push_back(v < table.start_count ? v : table.midpoint(at(p.a), at(p.b)));
    beyond += uniform_vertex.back() < 0;
  }
  std::vector<double> by_vertex(faces.size()), by_area(faces.size());
  parallel_for(static_cast<int>(faces.size()), threads, [&](int i) {
    const auto s = static_cast<size_t>(i);
    const Eigen::VectorXd d = squared_distances(faces[s], t, level, uniform_vertex);
    const Eigen::VectorXd areas = vertex_areas(faces[s], uniform_faces);
    by_vertex[s] = d.mean();
    by_area[s] = d.dot(areas) / areas.sum();
  });
  double vertex_mean = 0, area_mean = 0;
  for (size_t s = 0; s < faces.size(); ++s) {
    vertex_mean += by_vertex[s] / static_cast<double>(faces.size());
    area_mean += by_area[s] / static_cast<double>(faces.size());
  }
  const Faces& F = t.levels[level].F;
  std::printf("%-10s %6d %6d %4d   %.4f mm   %.4f mm   %d\n", name, t.levels[level].vertex_count,
              static_cast<int>(F.rows()), boundary_edge_count(F), std::sqrt(vertex_mean), std::sqrt(area_mean), beyond);
}

int run(const std::filesystem::path& decide, const std::filesystem::path& test, int threads) {
  const ReferenceFace face = default_reference_face();
  MultiresTemplate uniform = uniform_hierarchy(face.mesh, face.mirror, face.landmarks, 3448);
  for (const auto& [name, vertices] : face.regions) uniform.regions[name] = refine_region(uniform, vertices);
  const std::vector<Vertices> faces = registered(test, uniform, threads);
  const DeviationTable table = measure_deviation(tri_quad_mesh(face.mesh, face.mirror, 3448), {uniform.V});
  const auto scratch = std::filesystem::temp_directory_path() / "level_tables";
  std::printf("%d faces\ncriterion  vertices triangles border  rms over vertices, over area, vertices beyond uniform\n",
              static_cast<int>(faces.size()));
  for (const LevelCriterion c : {LevelCriterion::length, LevelCriterion::bend, LevelCriterion::deviation}) {
    BuildPipelineOptions options;
    options.criterion = c;
    options.jobs = threads;
    const LevelDecision d = decide_levels(face, find_scans(decide), options, {scratch});
    for (const size_t level : {size_t{2}, size_t{3}})
      print_level(criterion_name(d.summary.criterion), d.reference, level, table, faces, uniform.levels.back().F,
                  threads);
  }
  std::filesystem::remove_all(scratch);
  return 0;
}

}  // namespace
}  // namespace facewright

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: level_tables DECIDE TEST [THREADS]   two folders of scans with landmarks\n");
    return 2;
  }
  try {
    return facewright::run(argv[1], argv[2], argc > 3 ? std::atoi(argv[3]) : 0);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "level_tables: %s\n", e.what());
    return 1;
  }
}
