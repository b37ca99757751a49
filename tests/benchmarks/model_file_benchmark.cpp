// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Loading of model files: the built-in face with 3448, 16759 and 29587 vertices, 63 shape and 63 colour modes at
// random, landmarks, regions, symmetry, parents and texture coordinates as a build leaves them. From the page cache.
#include <benchmark/benchmark.h>

#include <Eigen/QR>
#include <filesystem>

#include "libmodel/interop/eos_model.h"
#include "libmodel/interop/export_model.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/model/model_file.h"
#include "libregister/reference/reference_face.h"

namespace facewright {
namespace {

constexpr Eigen::Index kModes = 63;  // of the Surrey Face Model

PcaModel random_modes(const Eigen::VectorXd& mean, double sigma, Random& random) {
  const Eigen::MatrixXd X = Eigen::MatrixXd::NullaryExpr(mean.size(), kModes, [&] { return random.normal(); });
  PcaModel pca;
  pca.mean = mean;
  pca.basis = Eigen::HouseholderQR<Eigen::MatrixXd>(X).householderQ() * Eigen::MatrixXd::Identity(mean.size(), kModes);
  pca.variances =
      Eigen::VectorXd::NullaryExpr(kModes, [&](Eigen::Index k) { return sigma * sigma * std::pow(0.9, double(k)); });
  return pca;
}

MorphableModel whole_model() {
  const MultiresTemplate reference = default_reference();
  Random random(1);
  MorphableModelParts p;
  p.shape = random_modes(as_vector(reference.V), 200, random);
  p.colour = random_modes(Eigen::VectorXd::Constant(p.shape.mean.size(), 0.4), 5, random);
  p.uv = (reference.V.leftCols<2>().array() / 400 + 0.5).matrix();
  p.mirror = reference.mirror;
  p.parents = reference.parents;
  p.base_faces = reference.levels.front().F;
  p.regions = reference.regions;
  p.provenance = {{"program", "benchmark"}};
  for (size_t l = 1; l < reference.levels.size(); ++l)
    p.levels.push_back(
        {reference.levels[l].vertex_count, reference.levels[l].F, landmark_points(reference, static_cast<int>(l))});
  p.landmarks = landmarks_on_vertices(reference.landmarks, p.base_faces, p.levels.front().F);
  return MorphableModel(std::move(p));
}

// The files, made once.
const std::filesystem::path& files() {
  static const std::filesystem::path folder = [] {
    const std::filesystem::path at = std::filesystem::temp_directory_path() / "facewright_benchmark_model_files";
    const MorphableModel model = whole_model();
    save_model(at / "whole.h5", model);
    const MorphableModel coarse = orthonormalised(model.level(0));
    save_model(at / "3448.h5", coarse);
    write_file(at / "3448.bin", eos_model_bytes(coarse, 1));
    MorphableModelParts shape_only = coarse.parts();
    shape_only.colour = {};
    save_model(at / "3448_shape.h5", MorphableModel(shape_only));
    write_file(at / "3448_shape.bin", eos_model_bytes(MorphableModel(shape_only), 1));
    return at;
  }();
  return folder;
}

void load(benchmark::State& state, const char* name, const char* group) {
  const std::filesystem::path file = files() / name;
  for (auto _ : state) benchmark::DoNotOptimize(load_model(file, group));
  state.counters["MB"] = static_cast<double>(std::filesystem::file_size(file)) / 1e6;
}
void load_eos(benchmark::State& state, const char* name) {
  const std::filesystem::path file = files() / name;
  for (auto _ : state) benchmark::DoNotOptimize(read_eos_model(file));
  state.counters["MB"] = static_cast<double>(std::filesystem::file_size(file)) / 1e6;
}

BENCHMARK_CAPTURE(load, Whole29587ShapeAndColour, "whole.h5", "/")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(load, Level3448OfTheWhole, "whole.h5", "/level0")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(load, File3448ShapeAndColour, "3448.h5", "/")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(load, File3448Shape, "3448_shape.h5", "/")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(load_eos, File3448ShapeAndColour, "3448.bin")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(load_eos, File3448Shape, "3448_shape.bin")->Unit(benchmark::kMillisecond)->UseRealTime();

void SaveWhole(benchmark::State& state) {
  const MorphableModel model = load_model(files() / "whole.h5");
  for (auto _ : state) benchmark::DoNotOptimize(serialise_model(model));
}
BENCHMARK(SaveWhole)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace facewright

BENCHMARK_MAIN();
