// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/handedness.h"

namespace facewright {
namespace {

double doubled_uv_area(const Mesh& mesh, int f) {
  const Faces& T = mesh.uv_faces.rows() > 0 ? mesh.uv_faces : mesh.F;
  const Eigen::RowVector2d a = mesh.uv.row(T(f, 0)), b = mesh.uv.row(T(f, 1)) - a, c = mesh.uv.row(T(f, 2)) - a;
  return b[0] * c[1] - b[1] * c[0];
}

}  // namespace

SurfaceSides surface_sides(const Mesh& mesh, const SurfaceSample& scan, const FaceAlignment& face) {
  int points = 0, outward = 0, textured = 0, unmirrored = 0;
  for (size_t i = 0; i < face.partner.size(); ++i) {
    const int p = face.partner[i];
    if (p < 0) continue;
    const bool shows_outward = scan.N.row(p).dot(face.normal[i]) > 0;
    ++points, outward += shows_outward;
    const double area = mesh.has_uv() ? doubled_uv_area(mesh, scan.triangle[static_cast<size_t>(p)]) : 0;
    if (area == 0) continue;
    ++textured, unmirrored += shows_outward == (area > 0);
  }
  SurfaceSides sides;
  if (points > 0) sides.outward = static_cast<double>(outward) / points;
  if (2 * textured > points) sides.unmirrored = static_cast<double>(unmirrored) / textured;
  return sides;
}

}  // namespace facewright
