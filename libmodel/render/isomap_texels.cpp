// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/isomap_texels.h"

#include <algorithm>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/render/sampling.h"
#include "libmodel/render/scan_conversion.h"

namespace facewright {

IsomapTexels isomap_texels(const Mesh& mesh, int size) {
  if (!mesh.has_uv()) throw InvalidInput("texture: the mesh has no texture coordinates; the model needs a UV map");
  if (size < 8 || size > 8192) throw InvalidInput("texture: expected a size of 8..8192, got " + std::to_string(size));
  IsomapTexels map;
  map.size = size;
  map.corners = mesh.uv_faces.rows() > 0 ? mesh.uv_faces : mesh.F;
  check_raster_indices(map.corners, mesh.uv.rows());
  ProjectedVertices flat;
  flat.pixels.resize(mesh.uv.rows(), 2);
  for (Eigen::Index i = 0; i < mesh.uv.rows(); ++i)
    flat.pixels.row(i) = texel_position(mesh.uv.row(i).transpose(), size, size).transpose();
  flat.depth = Eigen::VectorXd::Zero(mesh.uv.rows());
  constexpr int band_rows = 16;
  const ScanList list = scan_list(flat, map.corners, size, false);
  const auto bands = bands_of(list, size, band_rows);
  VisibilityRows rows;
  for (size_t band = 0; band < bands.size(); ++band) {
    const int first = static_cast<int>(band) * band_rows;
    rows.clear(0, size, first, std::min(band_rows, size - first));
    for (const int i : bands[band]) rows.draw(list.items[static_cast<size_t>(i)], size);
    for (int y = rows.first_row(); y <= rows.last_row(); ++y) {
      map.row_start.push_back(static_cast<int>(map.runs.size()));
      for_each_run(rows, y, [&](int f, int begin, int end) {
        map.runs.push_back({f, begin, end});
        map.count += end - begin;
      });
    }
  }
  map.row_start.push_back(static_cast<int>(map.runs.size()));
  map.texels = std::move(flat.pixels);
  return map;
}

}  // namespace facewright
