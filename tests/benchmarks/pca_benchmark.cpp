// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Principal component analysis of as many scans as the Surrey model was made of, by each solver.
#include <benchmark/benchmark.h>

#include <cmath>
#include <fstream>
#include <string>

#include "libmodel/building/pca.h"
#include "libmodel/core/random.h"

namespace facewright {
namespace {

constexpr Eigen::Index kVertices = 29587;

// Faces whose variances fall as k^-1.6: 99 % needs about 100 modes.
const SampleMatrix& planted(Eigen::Index scans) {
  static SampleMatrix X;
  if (X.rows() == scans) return X;
  // Directions that are orthogonal on average.
  const Eigen::Index modes = std::min<Eigen::Index>(scans - 1, 250);
  Random random(1);
  SampleMatrix directions(modes, 3 * kVertices), amounts(scans, modes);
  for (double& value : directions.reshaped()) value = (random.bits() & 1) != 0 ? 1 : -1;
  for (Eigen::Index k = 0; k < modes; ++k)
    for (Eigen::Index i = 0; i < scans; ++i) amounts(i, k) = 6 * std::pow(k + 1.0, -0.8) * random.normal();
  X.setConstant(scans, 3 * kVertices, 80);
  X.noalias() += amounts * directions;
  return X;
}

void fit(benchmark::State& state, PcaSolver solver) {
  const SampleMatrix& X = planted(state.range(0));
  PcaOptions options;
  options.solver = solver;
  options.threads = static_cast<int>(state.range(1));
  PcaResult result;
  for (auto _ : state) benchmark::DoNotOptimize(result = fit_pca(X, options));
  state.counters["modes"] = result.summary.mode_count;
  state.counters["kept"] = result.summary.kept_variance;
  state.counters["iterations"] = result.summary.iterations;
  state.counters["residual"] = result.summary.residual;
}

void arguments(benchmark::internal::Benchmark* bench) {
  bench->ArgNames({"scans", "threads"})->Args({169, 1})->Args({169, 2})->Unit(benchmark::kMillisecond)->UseRealTime();
  bench->MeasureProcessCPUTime();
}

BENCHMARK_CAPTURE(fit, gram, PcaSolver::gram)->Apply(arguments);
BENCHMARK_CAPTURE(fit, lanczos, PcaSolver::lanczos)->Apply(arguments)->Args({1000, 2});
BENCHMARK_CAPTURE(fit, gram_of_many, PcaSolver::gram)
    ->ArgNames({"scans", "threads"})
    ->Args({1000, 2})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(fit, randomised, PcaSolver::randomised)->Apply(arguments)->Args({1000, 2});

}  // namespace
}  // namespace facewright

// With --samples FILE: writes the matrix (169 x 88761 float64, rows) for others to analyse, and ends.
int main(int argc, char** argv) {
  if (argc == 3 && std::string(argv[1]) == "--samples") {
    const auto& X = facewright::planted(169);
    std::ofstream out(argv[2], std::ios::binary);
    out.write(reinterpret_cast<const char*>(X.data()), X.size() * static_cast<std::streamsize>(sizeof(double)));
    return out ? 0 : 1;
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
