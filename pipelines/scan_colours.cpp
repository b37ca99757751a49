// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/scan_colours.h"

#include <vector>

#include "libmodel/building/colour_sampling.h"
#include "libmodel/geometry/normals.h"

namespace facewright {

Mesh mesh_with_colours(const Scan& scan) {
  Mesh mesh = scan.mesh;
  if (mesh.has_colours() || !mesh.has_uv() || scan.texture.empty()) return mesh;
  std::vector<NearestPoint> points(static_cast<size_t>(mesh.V.rows()));
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      NearestPoint& p = points[static_cast<size_t>(mesh.F(f, k))];
      if (p.where.triangle >= 0) continue;
      p.where = {static_cast<int>(f), Eigen::Vector3d::Unit(k)};
      p.position = mesh.V.row(mesh.F(f, k));
    }
  for (size_t i = 0; i < points.size(); ++i)  // vertices of no triangle: any place will do
    if (points[i].where.triangle < 0) points[i].where = {0, Eigen::Vector3d::Unit(0)};
  mesh.colours = sample_colours(scan.mesh, scan.texture, points, 0.5 * vertex_edge_lengths(mesh.V, mesh.F));
  return mesh;
}

}  // namespace facewright
