// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// The hierarchy of 845 to 29587 vertices, and 4-8 bisection on flat arrays beside the same on OpenMesh's half-edges.
#include <benchmark/benchmark.h>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <queue>

#include "libregister/reference/reference_face.h"
#include "libregister/subdivision/deviation.h"
#include "libregister/subdivision/journal.h"

namespace facewright {
namespace {

constexpr int kFinest = 29587;

void SurreyHierarchy(benchmark::State& state) {
  const ReferenceFace face = default_reference_face();
  for (auto _ : state) benchmark::DoNotOptimize(build_hierarchy(face.mesh, face.mirror, face.landmarks));
}
BENCHMARK(SurreyHierarchy)->Unit(benchmark::kMillisecond);

void SurreyHierarchyByDeviation(benchmark::State& state) {
  const ReferenceFace face = default_reference_face();
  const Vertices uniform = uniform_hierarchy(face.mesh, face.mirror, {}, 3448, {2, 3}).V;
  const std::vector<Vertices> faces(6, uniform);
  for (auto _ : state) {
    HierarchyOptions options;
    options.criterion = deviation_criterion(measure_deviation(tri_quad_mesh(face.mesh, face.mirror, 3448), faces));
    benchmark::DoNotOptimize(build_hierarchy(face.mesh, face.mirror, face.landmarks, kSurreyLevels, options));
  }
}
BENCHMARK(SurreyHierarchyByDeviation)->Unit(benchmark::kMillisecond);

void ReplayOfTheJournal(benchmark::State& state) {
  const ReferenceFace face = default_reference_face();
  const MultiresTemplate t = build_hierarchy(face.mesh, face.mirror, face.landmarks);
  for (auto _ : state)
    benchmark::DoNotOptimize(
        replay(journal_of(t), face.mesh, face.mirror, face.landmarks, {845, 3448, 16759, kFinest}));
}
BENCHMARK(ReplayOfTheJournal)->Unit(benchmark::kMillisecond);

void LongestEdgeOnFlatArrays(benchmark::State& state) {
  const ReferenceFace face = default_reference_face();
  const FourEightMesh start(face.mesh.V, face.mesh.F, {}, pair_triangles(face.mesh.V, face.mesh.F));
  for (auto _ : state) {
    FourEightMesh mesh = start;
    refine_to(mesh, kFinest, bent_length_criterion(0));
    benchmark::DoNotOptimize(mesh.face_count());
  }
}
BENCHMARK(LongestEdgeOnFlatArrays)->Unit(benchmark::kMillisecond);

using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<>;

// 4-8 bisection by longest base edge on half-edges: a face knows its apex, the rest is OpenMesh's edge split.
class HalfEdgeBisection {
 public:
  explicit HalfEdgeBisection(const FourEightMesh& start) {
    const Vertices V = start.positions();
    const Faces F = start.faces();
    for (Eigen::Index v = 0; v < V.rows(); ++v)
      mesh_.add_vertex({static_cast<float>(V(v, 0)), static_cast<float>(V(v, 1)), static_cast<float>(V(v, 2))});
    for (Eigen::Index f = 0; f < F.rows(); ++f) {
      const auto at = [&](int k) { return mesh_.vertex_handle(static_cast<unsigned>(F(f, k))); };
      mesh_.property(apex_, mesh_.add_face(at(0), at(1), at(2))) = at(0);
    }
  }

  void refine_to(size_t vertices) {
    for (const auto f : mesh_.faces()) push(f);
    while (mesh_.n_vertices() < vertices) {
      const Candidate c = queue_.top();
      queue_.pop();
      if (mesh_.property(apex_, c.face) == c.apex) bisect(c.face);
    }
  }
  size_t face_count() const { return mesh_.n_faces(); }

 private:
  struct Candidate {
    double length;
    OpenMesh::FaceHandle face;
    OpenMesh::VertexHandle apex;
    bool operator<(const Candidate& o) const { return length < o.length; }
  };

  // The half-edge of f that faces its apex.
  OpenMesh::HalfedgeHandle base(OpenMesh::FaceHandle f) const {
    auto h = mesh_.halfedge_handle(f);
    while (mesh_.to_vertex_handle(mesh_.next_halfedge_handle(h)) != mesh_.property(apex_, f))
      h = mesh_.next_halfedge_handle(h);
    return h;
  }

  void push(OpenMesh::FaceHandle f) { queue_.push({mesh_.calc_edge_length(base(f)), f, mesh_.property(apex_, f)}); }

  void bisect(OpenMesh::FaceHandle f) {
    auto h = base(f);
    auto g = mesh_.face_handle(mesh_.opposite_halfedge_handle(h));
    if (g.is_valid() && base(g) != mesh_.opposite_halfedge_handle(h)) {
      bisect(g);
      h = base(f);
    }
    const auto m = mesh_.add_vertex(mesh_.calc_edge_midpoint(h));
    mesh_.split(mesh_.edge_handle(h), m);
    for (const auto x : mesh_.vf_range(m)) mesh_.property(apex_, x) = m;
    for (const auto x : mesh_.vf_range(m)) push(x);
  }

  HalfEdgeMesh mesh_;
  OpenMesh::FPropHandleT<OpenMesh::VertexHandle> apex_ = [this] {
    OpenMesh::FPropHandleT<OpenMesh::VertexHandle> p;
    mesh_.add_property(p);
    return p;
  }();
  std::priority_queue<Candidate> queue_;
};

void LongestEdgeOnHalfEdges(benchmark::State& state) {
  const ReferenceFace face = default_reference_face();
  const HalfEdgeBisection start(FourEightMesh(face.mesh.V, face.mesh.F, {}, pair_triangles(face.mesh.V, face.mesh.F)));
  for (auto _ : state) {
    HalfEdgeBisection mesh = start;
    mesh.refine_to(kFinest);
    benchmark::DoNotOptimize(mesh.face_count());
  }
}
BENCHMARK(LongestEdgeOnHalfEdges)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace facewright

BENCHMARK_MAIN();
