// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <benchmark/benchmark.h>

#include "libmodel/surface/nearest.h"
#include "libmodel/synthetic/scan_person.h"
#include "libregister/reference/reference_face.h"
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
  for (auto _ : state) benchmark::DoNotOptimize(denoise(scan().mesh));
  state.counters["vertices"] = static_cast<double>(scan().mesh.V.rows());
}
BENCHMARK(Denoise)->Unit(benchmark::kMillisecond);

void GlobalMapping(benchmark::State& state) {
  const MultiresTemplate reference = default_reference();
  const Mesh base = reference.level_mesh(0);
  const Landmarks marks = locate(reference.landmarks, base.V, base.F);
  for (auto _ : state) benchmark::DoNotOptimize(global_mapping(base.V, marks, scan().landmarks));
}
BENCHMARK(GlobalMapping)->Unit(benchmark::kMillisecond);

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

void RegisterScan(benchmark::State& state) {
  const MultiresTemplate reference = default_reference();
  for (auto _ : state) benchmark::DoNotOptimize(register_scan(scan().mesh, scan().landmarks, reference));
}
BENCHMARK(RegisterScan)->Unit(benchmark::kMillisecond)->Iterations(3);

}  // namespace
}  // namespace facewright

BENCHMARK_MAIN();
