// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/rasterizer.h"

#include <limits>

#include "libmodel/render/scan_conversion.h"

namespace facewright {
namespace {

Raster empty_raster(int width, int height) {
  check_raster_size(width, height);
  Raster raster;
  raster.width = width;
  raster.height = height;
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  raster.triangle.assign(pixels, -1);
  raster.depth.assign(pixels, -std::numeric_limits<float>::infinity());
  raster.barycentric.assign(pixels, {0, 0, 0});
  return raster;
}

/// Fills one row's run of one triangle.
void store_run(Raster& raster, const ProjectedVertices& p, const Faces& F, int f, int y, int begin, int end) {
  const std::array<int, 3> v = {F(f, 0), F(f, 1), F(f, 2)};
  const BarycentricPlanes planes(p.pixels, v[0], v[1], v[2]);
  for (int x = begin; x < end; ++x) {
    Eigen::Vector3d b(0, planes.b1(x, y), planes.b2(x, y));
    b[0] = 1 - b[1] - b[2];
    b = b.cwiseMax(0) / b.cwiseMax(0).sum();
    if (p.perspective()) {
      for (int k = 0; k < 3; ++k) b[k] *= p.inverse_w[v[static_cast<size_t>(k)]];
      b /= b.sum();
    }
    const size_t at = raster.index(x, y);
    raster.triangle[at] = f;
    raster.depth[at] = static_cast<float>(b[0] * p.depth[v[0]] + b[1] * p.depth[v[1]] + b[2] * p.depth[v[2]]);
    raster.barycentric[at] = {static_cast<float>(b[0]), static_cast<float>(b[1]), static_cast<float>(b[2])};
  }
}

}  // namespace

Raster rasterize(const ProjectedVertices& p, const Faces& F, const RasterOptions& options) {
  Raster raster = empty_raster(options.width, options.height);
  check_raster_indices(F, p.pixels.rows());
  constexpr int band_rows = 8;
  const ScanList list = scan_list(p, F, options.height, options.cull_backfaces);
  const auto bands = bands_of(list, options.height, band_rows);
  const PixelBox box = pixel_box(p.pixels, options.width, options.height);
  VisibilityRows rows;
  for (size_t band = 0; band < bands.size(); ++band) {
    if (bands[band].empty()) continue;
    const int first = static_cast<int>(band) * band_rows;
    rows.clear(box.left, box.right, first, std::min(band_rows, options.height - first));
    for (const int i : bands[band]) rows.draw(list.items[static_cast<size_t>(i)], options.width);
    for (int y = rows.first_row(); y <= rows.last_row(); ++y)
      for_each_run(rows, y, [&](int f, int begin, int end) { store_run(raster, p, F, f, y, begin, end); });
  }
  return raster;
}

Raster rasterize(const Vertices& V, const Faces& F, const AffineCamera& camera, const RasterOptions& options) {
  check_raster_size(options.width, options.height);
  return rasterize(project_vertices(V, camera), F, options);
}

Raster rasterize_flat(const TexCoords& pixels, const Faces& F, int width, int height) {
  ProjectedVertices p;
  p.pixels = pixels;
  p.depth = Eigen::VectorXd::Zero(pixels.rows());
  return rasterize(p, F, {width, height, false});
}

}  // namespace facewright
