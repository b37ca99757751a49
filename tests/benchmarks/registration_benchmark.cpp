// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <benchmark/benchmark.h>

#include <map>
#include <string>

#include "libmodel/core/topology.h"
#include "libmodel/surface/nearest.h"
#include "libmodel/synthetic/scan_person.h"
#include "libregister/reference/reference_face.h"
#include "libregister/registration/nicp.h"
#include "libregister/registration/register_scan.h"

namespace facewright {
namespace {

const SyntheticScan& scan() {
  static const SyntheticScan s = [] {
    const ParametricFace face;
    return scan_person(face, draw_person(face, 1, 0), 1, 0);
  }();
  return s;
}

void DefaultReference(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(default_reference());
}
BENCHMARK(DefaultReference)->Unit(benchmark::kMillisecond);

void Denoise(benchmark::State& state) {
  const Mesh& mesh = scan().mesh;  // made outside the clock
  for (auto _ : state) benchmark::DoNotOptimize(denoise(mesh));
  state.counters["vertices"] = static_cast<double>(scan().mesh.V.rows());
}
BENCHMARK(Denoise)->Unit(benchmark::kMillisecond);

void NearestSurfacePoint(benchmark::State& state) {
  const Mesh& m = scan().mesh;
  const SurfaceIndex index(m.V, m.F);
  const double off = static_cast<double>(state.range(0)) / 10;
  Eigen::Index i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(index.nearest(Eigen::Vector3d(m.V.row(i).transpose().array() + off)));
    i = (i + 97) % m.V.rows();
  }
}
BENCHMARK(NearestSurfacePoint)->Arg(1)->Arg(10)->Arg(100);  // tenths of a millimetre off, per axis

void SurfaceIndexBuild(benchmark::State& state) {
  const Mesh& m = scan().mesh;
  for (auto _ : state) benchmark::DoNotOptimize(SurfaceIndex(m.V, m.F));
  state.counters["triangles"] = static_cast<double>(m.F.rows());
}
BENCHMARK(SurfaceIndexBuild)->Unit(benchmark::kMillisecond);

void Edges(benchmark::State& state) {
  const Mesh& m = scan().mesh;
  for (auto _ : state) benchmark::DoNotOptimize(edges(m.F));
  state.counters["triangles"] = static_cast<double>(m.F.rows());
}
BENCHMARK(Edges)->Unit(benchmark::kMillisecond);

// One conformation of a level to the scan; 1: with what the one before has left in its workspace.
void Conform(benchmark::State& state) {
  const MultiresTemplate reference = default_reference();
  const Mesh level = reference.level_mesh(static_cast<int>(state.range(0)));
  const MatchTarget target(scan().mesh, Eigen::VectorXd::Ones(scan().mesh.V.rows()));
  const AlignResult aligned = align_landmarks(locate(reference.landmarks, level.V, level.F), scan().landmarks);
  const Vertices start = aligned.scan_from_reference.apply(level.V);
  const Correspondence matches = match_locally(start, level.F, reference.mirror, target);
  ConformOptions options;
  options.fold_rounds = 0;
  ConformWorkspace workspace;
  for (auto _ : state)
    benchmark::DoNotOptimize(
        conform(start, level.F, matches, {}, options, {}, state.range(1) == 1 ? &workspace : nullptr));
  state.counters["vertices"] = static_cast<double>(level.V.rows());
}
BENCHMARK(Conform)->ArgsProduct({{2, 3}, {0, 1}})->Unit(benchmark::kMillisecond);

// Counters: milliseconds of wall time per stage.
void RegisterScan(benchmark::State& state) {
  const MultiresTemplate reference = default_reference();
  std::map<std::string, double> stages;
  for (auto _ : state) {
    const RegistrationResult r = register_scan(scan().mesh, scan().landmarks, reference);
    for (const auto& [stage, seconds] : r.summary.seconds) stages[stage] += 1000 * seconds;
  }
  for (const auto& [stage, total] : stages) state.counters[stage] = total / static_cast<double>(state.iterations());
  state.counters["vertices"] = static_cast<double>(scan().mesh.V.rows());
}
BENCHMARK(RegisterScan)->Unit(benchmark::kMillisecond)->Iterations(3);

// Optimal-step non-rigid ICP of a level, from a similarity; the scan's denoising and search tree are not counted.
void Nicp(benchmark::State& state) {
  const MultiresTemplate reference = default_reference();
  const Mesh level = reference.level_mesh(static_cast<int>(state.range(0)));
  const AlignResult aligned = align_landmarks(locate(reference.landmarks, level.V, level.F), scan().landmarks);
  std::vector<LandmarkTarget> pulls;
  for (const std::string& name : aligned.used)
    pulls.push_back({reference.landmarks.at(name).vertex, aligned.landmarks.at(name).position, 1});
  DenoiseResult clean = denoise(scan().mesh);
  const MatchTarget target(std::move(clean.mesh), std::move(clean.reliability));
  const Vertices start = aligned.scan_from_reference.apply(level.V);
  for (auto _ : state) {
    const NicpResult r = nicp(start, level.F, target, pulls);
    state.counters["solves"] = static_cast<double>(r.summary.steps.size());
  }
  state.counters["vertices"] = static_cast<double>(level.V.rows());
}
BENCHMARK(Nicp)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
}  // namespace facewright

BENCHMARK_MAIN();
