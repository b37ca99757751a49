// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/colour_sampling.h"

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

using Corner = Eigen::Matrix<double, 3, 2>;  // texture coordinates of a triangle's corners

Corner corner_uv(const Mesh& scan, int f) {
  const Faces& index = scan.uv_faces.rows() > 0 ? scan.uv_faces : scan.F;
  Corner c;
  for (int k = 0; k < 3; ++k) c.row(k) = scan.uv.row(index(f, k));
  return c;
}

// Texels per millimetre on triangle f: square root of the ratio of its areas.
double texel_density(const Mesh& scan, const Image& texture, int f, const Corner& uv) {
  const Eigen::RowVector3d a = scan.V.row(scan.F(f, 0)), e1 = scan.V.row(scan.F(f, 1)) - a,
                           e2 = scan.V.row(scan.F(f, 2)) - a;
  const double area = std::sqrt(std::max(0.0, e1.squaredNorm() * e2.squaredNorm() - std::pow(e1.dot(e2), 2)));
  const Eigen::RowVector2d t1 = uv.row(1) - uv.row(0), t2 = uv.row(2) - uv.row(0);
  const double texels = std::abs(t1[0] * t2[1] - t1[1] * t2[0]) * texture.width * texture.height;
  return area > 1e-12 ? std::sqrt(texels / area) : 0;
}

Eigen::Vector3d texture_colour(const Mesh& scan, const Image& texture, const SurfacePoint& p, double footprint) {
  const Corner uv = corner_uv(scan, p.triangle);
  const Eigen::RowVector2d t = p.barycentric.transpose() * uv;
  // Texel centres lie at (i + 0.5) / width; v runs up, rows run down.
  const Eigen::Vector2d centre(t[0] * texture.width - 0.5, (1 - t[1]) * texture.height - 0.5);
  const double radius = 0.5 * footprint * texel_density(scan, texture, p.triangle, uv);
  Eigen::Vector3d sum = sample_linear(texture, centre);
  if (radius < 0.5) return sum;
  for (int k = 0; k < 6; ++k) {
    const double a = k * std::numbers::pi / 3;
    sum += sample_linear(texture, centre + radius * Eigen::Vector2d(std::cos(a), std::sin(a)));
  }
  return sum / 7;
}

}  // namespace

Colours sample_colours(const Mesh& scan, const Image& texture, const std::vector<NearestPoint>& points,
                       const Eigen::VectorXd& footprint) {
  if (footprint.size() != static_cast<Eigen::Index>(points.size()))
    throw InvalidInput("colour sampling: one footprint per point is needed");
  const bool textured = !texture.empty() && scan.has_uv();
  if (!textured && !scan.has_colours()) return {};
  Colours result(static_cast<Eigen::Index>(points.size()), 3);
  for (size_t i = 0; i < points.size(); ++i) {
    const SurfacePoint& p = points[i].where;
    const auto row = static_cast<Eigen::Index>(i);
    result.row(row) = textured ? texture_colour(scan, texture, p, footprint[row]).transpose()
                               : position(p, scan.colours, scan.F).transpose();
  }
  return result;
}

}  // namespace facewright
