// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/render_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/geometry/normals.h"
#include "libmodel/render/row_painter.h"
#include "libmodel/render/sampling.h"
#include "libmodel/render/scan_conversion.h"
#include "libmodel/render/srgb_encoder.h"

namespace facewright {
namespace {

void check(const RenderOptions& options) {
  if (options.supersampling < 1 || options.supersampling > 4)
    throw InvalidInput("render: expected supersampling 1..4, got " + std::to_string(options.supersampling));
  if (options.width < 1 || options.height < 1 || options.width > 8192 || options.height > 8192)
    throw InvalidInput("render: expected a size of 1..8192 pixels, got " + std::to_string(options.width) + " x " +
                       std::to_string(options.height));
}

Image background_image(const RenderOptions& options) {
  if (options.transparent) return Image(options.width, options.height, 4, 0);
  std::array<std::uint8_t, 3> c{};
  for (size_t k = 0; k < 3; ++k) c[k] = srgb8_from_linear(options.background[static_cast<Eigen::Index>(k)]);
  Image image(options.width, options.height, 3, c[0]);
  if (c[0] == c[1] && c[1] == c[2]) return image;
  for (int x = 0; x < options.width; ++x) std::memcpy(image.pixel(x, 0), c.data(), 3);
  for (int y = 1; y < options.height; ++y)
    std::memcpy(image.pixel(0, y), image.pixel(0, 0), 3 * static_cast<size_t>(options.width));
  return image;
}

/// Turns samples into bytes: n x n of them per pixel.
class RowResolver {
 public:
  RowResolver(const RenderOptions& options, Image& image)
      : n_(options.supersampling), options_(options), image_(image), encode_(SrgbEncoder::get()) {
    if (n_ == 1) return;
    sum_.resize(static_cast<size_t>(options.width));
    count_.resize(static_cast<size_t>(options.width));
  }

  void add(const RowPainter& painter, int fine_y) {
    for (const auto& [begin, end] : painter.spans()) {
      if (n_ == 1)
        write_row(painter.colours(), fine_y, begin, end);
      else
        accumulate(painter.colours(), begin, end);
    }
    if (n_ > 1 && fine_y % n_ == n_ - 1) flush(fine_y / n_);
  }

 private:
  void write_row(const Float4* colours, int y, int begin, int end) {
    const SrgbEncoder& encode = encode_;
    const int channels = image_.channels;
    std::uint8_t* out = image_.pixel(begin, y);
    for (int x = begin; x < end; ++x, out += channels) {
      encode.write(colours[x], out);
      if (channels == 4) out[3] = 255;
    }
  }
  void accumulate(const Float4* colours, int begin, int end) {
    for (int x = begin; x < end; ++x) {
      const auto at = static_cast<size_t>(x / n_);
      sum_[at] = count_[at] > 0 ? sum_[at] + colours[x] : colours[x];
      ++count_[at];
    }
  }
  void flush(int y) {
    const Eigen::Vector3f b = options_.background.cast<float>();
    const Float4 background = {b[0], b[1], b[2], 0};
    for (int x = 0; x < image_.width; ++x) {
      int& covered = count_[static_cast<size_t>(x)];
      if (covered == 0) continue;
      const float alpha = static_cast<float>(covered) / static_cast<float>(n_ * n_);
      Float4 c = sum_[static_cast<size_t>(x)] / broadcast4(static_cast<float>(covered));
      if (!options_.transparent) c = broadcast4(alpha) * c + broadcast4(1 - alpha) * background;
      std::uint8_t* out = image_.pixel(x, y);
      encode_.write(c, out);
      if (options_.transparent) out[3] = static_cast<std::uint8_t>(std::lround(255 * alpha));
      covered = 0;
    }
  }

  int n_;
  const RenderOptions& options_;
  Image& image_;
  const SrgbEncoder& encode_;
  std::vector<Float4> sum_;
  std::vector<int> count_;
};

Image paint_picture(const PaintedMesh& scene, const RenderOptions& options) {
  Image image = background_image(options);
  const int n = options.supersampling, width = n * options.width, height = n * options.height;
  const int band_rows = 8 / n * n;
  const ScanList list = scan_list(scene.projected, scene.mesh->F, height, false);
  const auto bands = bands_of(list, height, band_rows);
  const PixelBox box = pixel_box(scene.projected.pixels, width, height);
  const ChannelPlanes planes(scene, list);
  parallel_blocks(static_cast<int>(bands.size()), options.threads, [&](int first_band, int last_band) {
    VisibilityRows rows;
    RowPainter painter(scene, planes, width);
    RowResolver resolver(options, image);
    for (int band = first_band; band < last_band; ++band) {
      const std::vector<int>& items = bands[static_cast<size_t>(band)];
      if (items.empty()) continue;
      const int first = band * band_rows;
      rows.clear(box.left, box.right, first, std::min(band_rows, height - first));
      for (const int i : items) rows.draw(list.items[static_cast<size_t>(i)], width);
      for (int y = rows.first_row(); y <= rows.last_row(); ++y) {
        painter.paint(rows, y);
        resolver.add(painter, y);
      }
    }
  });
  return image;
}

/// `texture` if it is prepared, else from `plain` with as many levels as are needed.
Image render(const Mesh& mesh, ProjectedVertices projected, const Eigen::Matrix3d& R, const RenderOptions& options,
             const Image* plain, const LinearImage* texture) {
  const int n = options.supersampling;
  if (n > 1) projected.pixels = (n * (projected.pixels.array() + 0.5) - 0.5).matrix();  // centres are whole numbers
  PaintedMesh scene;
  scene.mesh = &mesh;
  scene.projected = std::move(projected);
  if (options.shading == Shading::studio) scene.normals = vertex_normals(mesh.V, mesh.F) * R.transpose();
  scene.coloured = options.use_colours && mesh.has_colours();
  std::optional<LinearImage> prepared;
  if (options.use_colours && mesh.has_uv() && (texture || (plain && !plain->empty()))) {
    const int width = texture ? texture->width() : plain->width, height = texture ? texture->height() : plain->height;
    scene.texels.resize(mesh.uv.rows(), 2);
    for (Eigen::Index i = 0; i < mesh.uv.rows(); ++i)
      scene.texels.row(i) = texel_position(mesh.uv.row(i).transpose(), width, height).transpose();
    scene.lod = texture_lod(mesh, scene.projected, scene.texels);
    const double levels = scene.lod.size() > 0 ? std::ceil(std::max(0.0F, scene.lod.maxCoeff())) + 1 : 1;
    if (!texture) prepared.emplace(*plain, static_cast<int>(levels));
    scene.texture = texture ? texture : &*prepared;
  }
  return paint_picture(scene, options);
}

void check(const Mesh& mesh, const RenderOptions& options) {
  check(options);
  validate(mesh);
}

}  // namespace

Image render_mesh(const Mesh& mesh, const OrthographicCamera& camera, const RenderOptions& options,
                  const Image& texture) {
  check(mesh, options);
  return render(mesh, project_vertices(mesh.V, camera.affine()), camera.R, options, &texture, nullptr);
}

Image render_mesh(const Mesh& mesh, const PerspectiveCamera& camera, const RenderOptions& options,
                  const Image& texture) {
  check(mesh, options);
  return render(mesh, project_vertices(mesh.V, camera), camera.R, options, &texture, nullptr);
}

Image render_mesh(const Mesh& mesh, const OrthographicCamera& camera, const RenderOptions& options,
                  const LinearImage& texture) {
  check(mesh, options);
  return render(mesh, project_vertices(mesh.V, camera.affine()), camera.R, options, nullptr, &texture);
}

Image render_mesh(const Mesh& mesh, const PerspectiveCamera& camera, const RenderOptions& options,
                  const LinearImage& texture) {
  check(mesh, options);
  return render(mesh, project_vertices(mesh.V, camera), camera.R, options, nullptr, &texture);
}

}  // namespace facewright
