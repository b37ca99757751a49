// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/row_painter.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace facewright {
namespace {

constexpr std::array<float, 3> clay = {0.50F, 0.48F, 0.46F};

/// 1 / sqrt(x) to a float's accuracy with plain arithmetic: the compiler does four at a time, and every processor
/// gives the same bits. Newton's iteration.
inline float inverse_root(float x) {
  float y = std::bit_cast<float>(0x5f3759df - (std::bit_cast<std::int32_t>(x) >> 1));
  const float half = 0.5F * x;
  for (int k = 0; k < 3; ++k) y *= 1.5F - half * y * y;
  return y;
}

/// Light that arrives for a unit normal in camera axes (+x right, +y up, +z to the viewer); about 1 facing the viewer:
/// sky above and floor below, a large soft box that reaches around the edge, a weak light from the right.
inline float studio_light(float x, float y, float z) {
  constexpr float k = 1.0331989F, f = 0.8803408F;  // lengths of the two directions
  const float key = ((-0.45F / k) * x + (0.55F / k) * y + (0.75F / k) * z + 0.1F) / 1.1F;
  const float fill = ((0.75F / f) * x + (0.1F / f) * y + (0.45F / f) * z);
  return 0.10F + 0.13F * (1 + y) + 0.95F * (key > 0 ? key : 0) + 0.10F * (fill > 0 ? fill : 0);
}

}  // namespace

Eigen::VectorXf texture_lod(const Mesh& mesh, const ProjectedVertices& projected, const TexCoords& texels) {
  const Faces& corners = mesh.uv_faces.rows() > 0 ? mesh.uv_faces : mesh.F;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(mesh.V.rows()), count = sum;
  double largest = 0;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    const BarycentricPlanes planes(projected.pixels, mesh.F(f, 0), mesh.F(f, 1), mesh.F(f, 2));
    double dx = 0, dy = 0;  // squared texels per pixel
    for (int k = 0; k < 2; ++k) {
      const ScreenPlane q = planes.plane(texels(corners(f, 0), k), texels(corners(f, 1), k), texels(corners(f, 2), k));
      dx += q.dx * q.dx, dy += q.dy * q.dy;
    }
    const double texels2 = std::max(dx, dy);
    if (!(texels2 < 1e12)) continue;
    largest = std::max(largest, texels2);
    for (int k = 0; k < 3; ++k) sum[mesh.F(f, k)] += texels2, count[mesh.F(f, k)] += 1;
  }
  if (largest <= 1.0001) return {};
  Eigen::VectorXf lod(mesh.V.rows());
  for (Eigen::Index i = 0; i < lod.size(); ++i)
    lod[i] = sum[i] > 0 ? static_cast<float>(0.5 * std::log2(sum[i] / count[i])) : 0;
  return lod;
}

RowPainter::RowPainter(const PaintedMesh& scene, int width) : scene_(scene), colours_(static_cast<size_t>(width)) {
  base_colours_ = scene.coloured && !(scene.texture && scene.texture->opaque());
  const auto use = [&](std::initializer_list<Channel> some) {
    for (const Channel k : some) channels_[k].assign(static_cast<size_t>(width), 0);
  };
  if (scene.texture) use({kU, kV});
  if (scene.texture && scene.lod.size() > 0) use({kLod});
  if (scene.normals.rows() > 0) use({kNormalX, kNormalY, kNormalZ, kGain});
  if (base_colours_) use({kRed, kGreen, kBlue});
  if (scene.projected.perspective()) use({kInverseW});
}

void RowPainter::add_run(int f, int y, int begin, int end) {
  const Mesh& mesh = *scene_.mesh;
  const ProjectedVertices& p = scene_.projected;
  const std::array<int, 3> v = {mesh.F(f, 0), mesh.F(f, 1), mesh.F(f, 2)};
  const BarycentricPlanes planes(p.pixels, v[0], v[1], v[2]);
  const double b1 = planes.b1(begin, y), b2 = planes.b2(begin, y);
  const auto linear = [&](Channel k, double a0, double a1, double a2) {
    const auto start = static_cast<float>(a0 + b1 * (a1 - a0) + b2 * (a2 - a0));
    const auto step = static_cast<float>(planes.b1_dx * (a1 - a0) + planes.b2_dx * (a2 - a0));
    float* out = row(k) + begin;
    for (int i = 0; i < end - begin; ++i) out[i] = start + step * static_cast<float>(i);
  };
  std::array<double, 3> w = {1, 1, 1};
  if (p.perspective()) {
    w = {p.inverse_w[v[0]], p.inverse_w[v[1]], p.inverse_w[v[2]]};
    linear(kInverseW, w[0], w[1], w[2]);
  }
  if (scene_.texture) {
    const Faces& corners = mesh.uv_faces.rows() > 0 ? mesh.uv_faces : mesh.F;
    const TexCoords& t = scene_.texels;
    const int a = corners(f, 0), b = corners(f, 1), c = corners(f, 2);
    linear(kU, w[0] * t(a, 0), w[1] * t(b, 0), w[2] * t(c, 0));
    linear(kV, w[0] * t(a, 1), w[1] * t(b, 1), w[2] * t(c, 1));
    if (scene_.lod.size() > 0) linear(kLod, w[0] * scene_.lod[v[0]], w[1] * scene_.lod[v[1]], w[2] * scene_.lod[v[2]]);
  }
  const auto vector = [&](Channel first, const Vertices& rows, double sign) {
    for (int k = 0; k < 3; ++k)
      linear(static_cast<Channel>(first + k), sign * w[0] * rows(v[0], k), sign * w[1] * rows(v[1], k),
             sign * w[2] * rows(v[2], k));
  };
  if (scene_.normals.rows() > 0) {
    const bool away = planes.area2 > 0;  // back faces are shown dark
    vector(kNormalX, scene_.normals, away ? -1 : 1);
    std::fill(row(kGain) + begin, row(kGain) + end, away ? 0.25F : 1.0F);
  }
  if (base_colours_) vector(kRed, mesh.colours, 1);
}

void RowPainter::undo_perspective(int begin, int end) {
  const float* inverse = row(kInverseW);
  for (const Channel k : {kU, kV, kLod, kNormalX, kNormalY, kNormalZ, kRed, kGreen, kBlue}) {
    float* values = row(k);
    if (!channels_[k].empty())
      for (int x = begin; x < end; ++x) values[x] /= inverse[x];
  }
}

void RowPainter::light(int begin, int end) {
  const float *nx = row(kNormalX), *ny = row(kNormalY), *nz = row(kNormalZ);
  float* __restrict gain = row(kGain);
  for (int x = begin; x < end; ++x) {
    const float scale = inverse_root(nx[x] * nx[x] + ny[x] * ny[x] + nz[x] * nz[x] + 1e-30F);
    gain[x] *= studio_light(scale * nx[x], scale * ny[x], scale * nz[x]);
  }
}

void RowPainter::shade(int begin, int end) {
  const bool lit = !channels_[kGain].empty(), minified = !channels_[kLod].empty();
  for (int x = begin; x < end; ++x) {
    Rgba c(clay[0], clay[1], clay[2], 1);
    if (base_colours_) c = Rgba(row(kRed)[x], row(kGreen)[x], row(kBlue)[x], 1);
    if (scene_.texture) {
      const float u = row(kU)[x], v = row(kV)[x];
      const Rgba t = minified ? scene_.texture->sample_trilinear(u, v, row(kLod)[x]) : scene_.texture->sample(u, v);
      c = scene_.texture->opaque() ? t : Rgba(t + (1 - t[3]) * c);
    }
    if (lit) c *= row(kGain)[x];
    colours_[static_cast<size_t>(x)] = c.min(1.0F);
  }
}

void RowPainter::paint(const VisibilityRows& rows, int y) {
  spans_.clear();
  for_each_run(rows, y, [&](int f, int begin, int end) {
    add_run(f, y, begin, end);
    if (!spans_.empty() && spans_.back().second == begin)
      spans_.back().second = end;
    else
      spans_.emplace_back(begin, end);
  });
  for (const auto& [begin, end] : spans_) {
    if (scene_.projected.perspective()) undo_perspective(begin, end);
    if (!channels_[kGain].empty()) light(begin, end);
    shade(begin, end);
  }
}

}  // namespace facewright
