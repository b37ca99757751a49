// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Rendering and texture on one thread: the built-in face at 3448 vertices, a picture of 1280 x 1024 pixels. The first
// argument of a benchmark is the height of the face in it: 450 pixels are a portrait with about 180 between the outer
// corners of the eyes; 920 fill the picture.
#include <benchmark/benchmark.h>

#include <cmath>

#include "libmodel/fitting/fit_model.h"
#include "libmodel/fitting/texture.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/overlays.h"
#include "libmodel/render/render_mesh.h"
#include "libregister/reference/reference_face.h"

namespace facewright {
namespace {

constexpr int kWidth = 1280, kHeight = 1024;

/// Unrolled from a cylinder round the head: no isomap, but as large, and injective but for a fold of 112 triangles
/// below the chin, whose texels are seen by no camera in front. The slit between the lips belongs to no triangle.
TexCoords unrolled(const Vertices& V) {
  TexCoords uv(V.rows(), 2);
  for (Eigen::Index i = 0; i < V.rows(); ++i) uv.row(i) << std::atan2(V(i, 0), V(i, 2) + 20), V(i, 1) / 100;
  const Eigen::RowVector2d low = uv.colwise().minCoeff(), high = uv.colwise().maxCoeff();
  uv.rowwise() -= low;
  return (0.98 * uv / (high - low).maxCoeff()).array() + 0.01;
}

const Mesh& face(int level) {
  static const MultiresTemplate t = default_reference();
  static const std::vector<Mesh> meshes = [] {
    std::vector<Mesh> out;
    for (const TemplateLevel& l : t.levels) {
      Mesh mesh;
      mesh.V = t.V.topRows(l.vertex_count), mesh.F = l.F;
      mesh.uv = unrolled(mesh.V);
      mesh.colours = Colours::Constant(mesh.V.rows(), 3, 0.4);
      out.push_back(mesh);
    }
    return out;
  }();
  for (const Mesh& mesh : meshes)
    if (mesh.V.rows() == level) return mesh;
  return meshes.back();
}

Image pattern(int width, int height) {
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int k = 0; k < 3; ++k)
        image.pixel(x, y)[k] = static_cast<std::uint8_t>(130 + 60 * std::sin(0.07 * x + k) + 50 * std::cos(0.05 * y));
  return image;
}

OrthographicCamera camera_of(const Mesh& mesh, const benchmark::State& state, double yaw = 0.3) {
  OrthographicCamera camera = frame_camera(mesh.V, kWidth, kHeight, yaw);
  const double scale = static_cast<double>(state.range(0)) / (0.9 * kHeight);
  camera.s *= scale;
  const Eigen::Vector2d centre((kWidth - 1) / 2.0, (kHeight - 1) / 2.0);
  camera.t = centre + scale * (camera.t - centre);
  return camera;
}

PerspectiveCamera perspective_of(const OrthographicCamera& camera) {
  PerspectiveCamera p;
  p.R = camera.R, p.focal_px = 1500;
  const double depth = p.focal_px / camera.s;
  p.t = {(camera.t[0] - kWidth / 2.0) / camera.s, (kHeight / 2.0 - camera.t[1]) / camera.s, -depth};
  p.principal = {kWidth / 2.0, kHeight / 2.0};
  return p;
}

RenderOptions options_of(Shading shading, int supersampling) {
  RenderOptions options;
  options.width = kWidth, options.height = kHeight;
  options.shading = shading;
  options.supersampling = supersampling;
  options.threads = 1;
  return options;
}

void render(benchmark::State& state, Shading shading, int supersampling, bool prepared, bool perspective) {
  const Mesh& mesh = face(static_cast<int>(state.range(1)));
  const OrthographicCamera camera = camera_of(mesh, state);
  const PerspectiveCamera pinhole = perspective_of(camera);
  const RenderOptions options = options_of(shading, supersampling);
  const Image texture = pattern(512, 512);
  const LinearImage linear(texture);
  for (auto _ : state) {
    if (perspective)
      benchmark::DoNotOptimize(render_mesh(mesh, pinhole, options, linear));
    else if (prepared)
      benchmark::DoNotOptimize(render_mesh(mesh, camera, options, linear));
    else
      benchmark::DoNotOptimize(render_mesh(mesh, camera, options, texture));
  }
}

#define SIZES Args({450, 3448})->Args({920, 3448})->Args({920, 29587})->Unit(benchmark::kMillisecond)
BENCHMARK_CAPTURE(render, textured, Shading::none, 1, false, false)->SIZES;
BENCHMARK_CAPTURE(render, textured_prepared, Shading::none, 1, true, false)->SIZES;
BENCHMARK_CAPTURE(render, textured_prepared_perspective, Shading::none, 1, true, true)->SIZES;
BENCHMARK_CAPTURE(render, textured_prepared_shaded, Shading::studio, 1, true, false)->SIZES;
BENCHMARK_CAPTURE(render, textured_prepared_shaded_4_samples, Shading::studio, 2, true, false)->SIZES;

void wireframe(benchmark::State& state) {
  const Mesh& mesh = face(static_cast<int>(state.range(1)));
  const AffineCamera camera = camera_of(mesh, state).affine();
  Image image = pattern(kWidth, kHeight);
  for (auto _ : state) draw_wireframe(image, mesh.V, mesh.F, camera, {90, 170, 255}, 0.25);
}
BENCHMARK(wireframe)->SIZES;

void texture(benchmark::State& state) {
  const Mesh& mesh = face(static_cast<int>(state.range(1)));
  const AffineCamera camera = camera_of(mesh, state).affine();
  const Image image = pattern(kWidth, kHeight);
  TextureOptions options;
  options.size = static_cast<int>(state.range(2));
  options.threads = 1;
  for (auto _ : state) benchmark::DoNotOptimize(extract_texture(mesh, image, camera, options));
}
#define ISOMAPS                  \
  Args({450, 3448, 512})         \
      ->Args({450, 3448, 1024})  \
      ->Args({920, 3448, 512})   \
      ->Args({920, 3448, 1024})  \
      ->Args({920, 29587, 1024}) \
      ->Unit(benchmark::kMillisecond)
BENCHMARK(texture)->ISOMAPS;

}  // namespace
}  // namespace facewright

BENCHMARK_MAIN();
