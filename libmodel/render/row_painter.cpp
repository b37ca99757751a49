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

ChannelPlanes::ChannelPlanes(const PaintedMesh& scene, const ScanList& list) {
  const auto use = [&](bool condition, std::initializer_list<Channel> some) {
    for (const Channel k : some)
      if (condition) channels_.push_back(k);
  };
  use(scene.projected.perspective(), {Channel::inverse_w});
  use(scene.texture != nullptr, {Channel::u, Channel::v});
  use(scene.texture && scene.lod.size() > 0, {Channel::lod});
  use(scene.normals.rows() > 0, {Channel::normal_x, Channel::normal_y, Channel::normal_z});
  use(scene.shows_colours(), {Channel::red, Channel::green, Channel::blue});
  const auto triangles = static_cast<size_t>(scene.mesh->F.rows());
  planes_.resize(triangles * channels_.size());
  away_.resize(triangles);
  for (const ScanList::Item& item : list.items) {
    const auto corner = scene.mesh->F.row(item.scan.id);
    add(scene, item.scan.id, BarycentricPlanes(scene.projected.pixels, corner[0], corner[1], corner[2]));
  }
}

void ChannelPlanes::add(const PaintedMesh& scene, int f, const BarycentricPlanes& b) {
  const Mesh& mesh = *scene.mesh;
  const Faces& wedges = mesh.uv_faces.rows() > 0 ? mesh.uv_faces : mesh.F;
  const ProjectedVertices& p = scene.projected;
  const std::array<int, 3> v = {mesh.F(f, 0), mesh.F(f, 1), mesh.F(f, 2)};
  std::array<double, 3> w = {1, 1, 1};
  if (p.perspective()) w = {p.inverse_w[v[0]], p.inverse_w[v[1]], p.inverse_w[v[2]]};
  away_[static_cast<size_t>(f)] = b.area2 > 0;
  Plane* out = planes_.data() + static_cast<size_t>(f) * channels_.size();
  for (const Channel channel : channels_) {
    const auto value = [&](int k) -> double {
      const int i = v[static_cast<size_t>(k)];
      switch (channel) {
        case Channel::u:
        case Channel::v:
          return scene.texels(wedges(f, k), channel == Channel::v);
        case Channel::lod:
          return scene.lod[i];
        case Channel::inverse_w:
          return 1;
        case Channel::normal_x:
        case Channel::normal_y:
        case Channel::normal_z:
          return scene.normals(i, static_cast<int>(channel) - static_cast<int>(Channel::normal_x));
        default:
          return mesh.colours(i, static_cast<int>(channel) - static_cast<int>(Channel::red));
      }
    };
    const ScreenPlane q = b.plane(w[0] * value(0), w[1] * value(1), w[2] * value(2));
    *out++ = {static_cast<float>(q.value), static_cast<float>(q.dx), static_cast<float>(q.dy)};
  }
}

RowPainter::RowPainter(const PaintedMesh& scene, const ChannelPlanes& planes, int width)
    : scene_(scene), planes_(planes), colours_(static_cast<size_t>(width)) {
  for (const Channel k : planes.channels()) values(k).assign(static_cast<size_t>(width) + 4, 0);
  for (int level = 0; scene.texture && level < scene.texture->levels(); ++level)
    samplers_.push_back(scene.texture->sampler(level));
  if (scene.normals.rows() > 0) gain_.assign(static_cast<size_t>(width), 1);
}

void RowPainter::add_run(int f, int y, int begin, int end) {
  const int first_corner = scene_.mesh->F(f, 0);
  const TexCoords& p = scene_.projected.pixels;
  const auto x = static_cast<float>(begin - p(first_corner, 0)), dy = static_cast<float>(y - p(first_corner, 1));
  const ChannelPlanes::Plane* plane = planes_.of(f);
  for (const Channel channel : planes_.channels()) {
    const Float4 start = broadcast4(plane->value + plane->dx * x + plane->dy * dy);
    const Float4 slope = broadcast4(plane->dx), first = start + slope * Float4{0, 1, 2, 3};
    float* out = row(channel) + begin;
    // Up to three numbers too many are written; the next run overwrites them.
    for (int i = 0; i < end - begin; i += 4) store4(out + i, first + slope * broadcast4(static_cast<float>(i)));
    ++plane;
  }
  if (!gain_.empty())  // back faces are shown dark
    std::fill(gain_.begin() + begin, gain_.begin() + end, planes_.faces_away(f) ? -0.25F : 1.0F);
}

void RowPainter::undo_perspective(int begin, int end) {
  const float* inverse = row(Channel::inverse_w);
  for (const Channel k : planes_.channels()) {
    float* of_channel = row(k);
    if (k != Channel::inverse_w)
      for (int x = begin; x < end; ++x) of_channel[x] /= inverse[x];
  }
}

void RowPainter::light(int begin, int end) {
  const float *nx = row(Channel::normal_x), *ny = row(Channel::normal_y), *nz = row(Channel::normal_z);
  float* __restrict gain = gain_.data();
  for (int x = begin; x < end; ++x) {
    const float scale = inverse_root(nx[x] * nx[x] + ny[x] * ny[x] + nz[x] * nz[x] + 1e-30F);
    const float side = gain[x] < 0 ? -scale : scale;  // back faces: the other side's normal
    gain[x] = (gain[x] < 0 ? 0.25F : 1.0F) * studio_light(side * nx[x], side * ny[x], side * nz[x]);
  }
}

void RowPainter::base(int begin, int end) {
  const float *red = row(Channel::red), *green = row(Channel::green), *blue = row(Channel::blue);
  const bool coloured = scene_.shows_colours();
  Float4* out = colours_.data();
  for (int x = begin; x < end; ++x)
    out[x] = coloured ? Float4{red[x], green[x], blue[x], 1} : Float4{clay[0], clay[1], clay[2], 1};
}

void RowPainter::texture(int begin, int end) {
  const float *u = row(Channel::u), *v = row(Channel::v), *lod = row(Channel::lod);
  Float4* out = colours_.data();
  const LinearImage& image = *scene_.texture;
  const bool opaque = image.opaque(), minified = !values(Channel::lod).empty() && image.levels() > 1;
  const LinearImage::Sampler sample = image.sampler(0);
  if (!minified) {
    for (int x = begin; x < end; ++x) {
      const Float4 t = sample(u[x], v[x]);
      out[x] = opaque ? t : t + broadcast4(1 - t[3]) * out[x];
    }
    return;
  }
  const float top = static_cast<float>(image.levels() - 1) - 1e-3F;
  for (int x = begin; x < end; ++x) {
    Float4 t;
    if (lod[x] > 0) {
      const float between = std::min(lod[x], top);
      const auto level = static_cast<size_t>(between);
      const Float4 fine = samplers_[level](u[x], v[x]), coarse = samplers_[level + 1](u[x], v[x]);
      t = fine + broadcast4(between - static_cast<float>(level)) * (coarse - fine);
    } else {
      t = sample(u[x], v[x]);
    }
    out[x] = opaque ? t : t + broadcast4(1 - t[3]) * out[x];
  }
}

void RowPainter::shade(int begin, int end) {
  if (!scene_.texture || !scene_.texture->opaque()) base(begin, end);
  if (scene_.texture) texture(begin, end);
  if (gain_.empty()) return;
  light(begin, end);
  const float* gain = gain_.data();
  Float4* out = colours_.data();
  for (int x = begin; x < end; ++x) {
    const Float4 c = out[x] * broadcast4(gain[x]), one = broadcast4(1);
    out[x] = c < one ? c : one;
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
    shade(begin, end);
  }
}

}  // namespace facewright
