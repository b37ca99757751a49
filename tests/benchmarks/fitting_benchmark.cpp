// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
//
// Times of fitting to landmarks, one thread. usage: benchmark_fitting [--benchmark_min_time=1 ...]
// The face is the parametric reference refined to 3448 or 29,587 vertices with 63 random smooth modes; 50 landmarks:
// ibug 18..68 but for one inner lip corner; with contours the 17 of the jaw besides.
#include <benchmark/benchmark.h>

#include "libmodel/core/random.h"
#include "libmodel/fitting/fit_landmarks.h"
#include "libmodel/fitting/fit_shape.h"
#include "libmodel/fitting/orthographic_camera.h"
#include "libmodel/model/prepared_sampler.h"
#include "libregister/reference/reference_face.h"

namespace facewright {
namespace {

constexpr int kModes = 63;

/// Random fields, smooth over the face, with the falling variances of real models; not orthonormal, which no fit needs.
PcaModel random_shape(const Vertices& V) {
  Random random(7);
  PcaModel model;
  model.mean = as_vector(V);
  model.basis.resize(V.size(), kModes);
  model.orthonormal = false;
  for (int m = 0; m < kModes; ++m)
    for (int k = 0; k < 3; ++k) {
      const double wave = 0.012 * std::sqrt(1 + m);
      const Eigen::Vector3d frequency(wave * random.normal(), wave * random.normal(), wave * random.normal());
      const double phase = random.uniform(0, 6.28);
      for (Eigen::Index i = 0; i < V.rows(); ++i)
        model.basis(3 * i + k, m) = std::sin(V.row(i).dot(frequency) + phase) / std::sqrt(1.5 * V.rows());
    }
  model.variances = Eigen::VectorXd::LinSpaced(kModes, 0, kModes - 1).unaryExpr([&](double m) {
    return 4.0 * static_cast<double>(V.rows()) / (1 + m);
  });
  return model;
}

/// Levels of 3448 and 29,587 vertices, or the first of them alone.
MorphableModel random_model(bool fine) {
  const ReferenceFace face = default_reference_face();
  const MultiresTemplate reference = build_hierarchy(face.mesh, face.mirror, face.landmarks);
  MorphableModelParts parts;
  for (const TemplateLevel& level : reference.levels)
    if (level.vertex_count >= 3448 && (fine || parts.levels.empty()))
      parts.levels.push_back({level.vertex_count, level.F});
  const int n = parts.levels.back().vertex_count;
  parts.shape = random_shape(reference.V.topRows(n));
  parts.landmarks = reference.landmarks;
  return MorphableModel(std::move(parts));
}

const MorphableModel& model(bool fine = false) {
  static const MorphableModel coarse_model = random_model(false), fine_model = random_model(true);
  return fine ? fine_model : coarse_model;
}

OrthographicCamera camera_at(double yaw) { return {4.5, rotation({yaw, 0.1, -0.05}), {640, 500}}; }

/// A random person's landmarks with a pixel of noise, on a 1280 x 1024 image; `jaw` adds 1..17.
ImageLandmarks landmarks(bool jaw, double yaw, std::uint64_t noise_seed = 1) {
  Random person(3), noise(noise_seed);
  const Mesh mesh = model().instance(model().shape().draw_coefficients(person));
  const AffineCamera camera = camera_at(yaw).affine();
  ImageLandmarks out;
  for (int i = jaw ? 1 : 18; i <= 68; ++i) {
    const auto mark = model().landmarks().find(std::to_string(i));
    if (mark == model().landmarks().end() || i == 61) continue;
    const Eigen::Vector2d error(noise.normal(), noise.normal());
    out[mark->first].position = camera.project(mesh.V.row(mark->second.vertex).transpose()) + error;
  }
  return out;
}

struct Problem {
  std::vector<Observation> seen;
  LandmarkShapeModel local;
  Vertices X;
  Pixels x;
  std::vector<Information> W;
};
Problem problem() {
  Problem p;
  p.seen = observations(landmarks(false, 0.4), model(), {});
  p.local = landmark_shape_model(p.seen, model().shape(), -1);
  p.X = p.local.points(Eigen::VectorXd::Zero(kModes));
  p.x.resize(p.X.rows(), 2);
  for (Eigen::Index k = 0; k < p.x.rows(); ++k) p.x.row(k) = p.seen[static_cast<size_t>(k)].pixel.transpose();
  p.W.assign(p.seen.size(), Information::Identity() / 49);
  return p;
}

void PoseAffine(benchmark::State& state) {
  const Problem p = problem();
  for (auto _ : state) benchmark::DoNotOptimize(estimate_affine_camera(p.X, p.x));
}
BENCHMARK(PoseAffine)->Unit(benchmark::kMicrosecond);

void PoseOrthographicLinear(benchmark::State& state) {
  const Problem p = problem();
  for (auto _ : state) benchmark::DoNotOptimize(estimate_orthographic_camera(p.X, p.x));
  state.counters["landmarks"] = static_cast<double>(p.X.rows());
}
BENCHMARK(PoseOrthographicLinear)->Unit(benchmark::kMicrosecond);

void PoseOrthographicRefined(benchmark::State& state) {
  const Problem p = problem();
  const OrthographicCamera start = estimate_orthographic_camera(p.X, p.x);
  for (auto _ : state) benchmark::DoNotOptimize(refine_orthographic(start, p.X, p.x, p.W));
}
BENCHMARK(PoseOrthographicRefined)->Unit(benchmark::kMicrosecond);

void Shape(benchmark::State& state) {
  const Problem p = problem();
  const AffineCamera camera = estimate_orthographic_camera(p.X, p.x).affine();
  for (auto _ : state) benchmark::DoNotOptimize(fit_shape(p.local, p.seen, camera, p.W, 1));
}
BENCHMARK(Shape)->Unit(benchmark::kMicrosecond);

FitOptions five_rounds(bool contour) {
  FitOptions options;
  options.iterations = 5;
  options.tolerance = 0;
  options.jaw = contour ? JawMode::contour : JawMode::slide;
  return options;
}

void PoseAndShape(benchmark::State& state) {
  const ImageLandmarks marks = landmarks(false, 0.4);
  for (auto _ : state) benchmark::DoNotOptimize(fit_landmarks(model(), marks, five_rounds(false)));
}
BENCHMARK(PoseAndShape)->Unit(benchmark::kMicrosecond);

void PoseAndShapeWithContours(benchmark::State& state) {
  const ImageLandmarks marks = landmarks(true, 0.4);
  const MorphableModel& faces = model(state.range(0) != 0);
  for (auto _ : state) benchmark::DoNotOptimize(fit_landmarks(faces, marks, five_rounds(true)));
  state.counters["vertices"] = faces.vertex_count();
}
BENCHMARK(PoseAndShapeWithContours)->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

void UntilConvergedWithContoursAndMesh(benchmark::State& state) {
  const ImageLandmarks marks = landmarks(true, 0.4);
  FitOptions options;
  options.jaw = JawMode::contour;
  for (auto _ : state) benchmark::DoNotOptimize(fitted_mesh(model(true), fit_landmarks(model(true), marks, options)));
}
BENCHMARK(UntilConvergedWithContoursAndMesh)->Unit(benchmark::kMicrosecond);

void ThreeImagesWithContours(benchmark::State& state) {
  const std::vector<ImageLandmarks> images = {landmarks(true, 0, 1), landmarks(true, 0.4, 2), landmarks(true, -0.5, 3)};
  for (auto _ : state) benchmark::DoNotOptimize(fit_landmarks_multi(model(), images, five_rounds(true)));
}
BENCHMARK(ThreeImagesWithContours)->Unit(benchmark::kMicrosecond);

void Outline(benchmark::State& state) {
  const Mesh mesh = model().mean();
  const std::vector<Edge> E = edges(mesh.F);
  for (auto _ : state) benchmark::DoNotOptimize(visible_outline(mesh.V, mesh.F, E, camera_at(0.4).affine()));
}
BENCHMARK(Outline)->Unit(benchmark::kMicrosecond);

void EdgeTopology(benchmark::State& state) {
  const Faces F = model().faces();
  for (auto _ : state) benchmark::DoNotOptimize(edges(F));
}
BENCHMARK(EdgeTopology)->Unit(benchmark::kMicrosecond);

void SamplePositions(benchmark::State& state) {
  Random random(5);
  const Eigen::VectorXd c = model().shape().draw_coefficients(random);
  for (auto _ : state) benchmark::DoNotOptimize(model().shape().instance(c));
}
BENCHMARK(SamplePositions)->Unit(benchmark::kMicrosecond);

void SampleMesh(benchmark::State& state) {
  Random random(5);
  const Eigen::VectorXd c = model().shape().draw_coefficients(random);
  for (auto _ : state) benchmark::DoNotOptimize(model().instance(c));
}
BENCHMARK(SampleMesh)->Unit(benchmark::kMicrosecond);

/// Into a mesh that keeps its triangles, the model prepared before.
void SampleMeshPrepared(benchmark::State& state) {
  Random random(5);
  const Eigen::VectorXd c = model().shape().draw_coefficients(random);
  const PreparedSampler sampler(model().shape());
  Mesh mesh = model().mean();
  for (auto _ : state) {
    sampler.instance(c, mesh.V);
    benchmark::DoNotOptimize(mesh.V.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(SampleMeshPrepared)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace facewright
BENCHMARK_MAIN();
