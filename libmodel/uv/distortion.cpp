// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/uv/distortion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

double cross(const Eigen::RowVector2d& a, const Eigen::RowVector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

struct Stretch {
  double area = 0;   // on the surface
  double trace = 0;  // s1^2 + s2^2
  double det = 0;    // s1 s2 >= 0
  bool flipped = true;
};

// From surface to plane: columns of J are the images of an orthonormal frame of the triangle.
Stretch stretch_of(const Eigen::Vector3d& e1, const Eigen::Vector3d& e2, const Eigen::RowVector2d& u1,
                   const Eigen::RowVector2d& u2) {
  Stretch s;
  s.area = 0.5 * e1.cross(e2).norm();
  const double length = e1.norm();
  const double signed_area = 0.5 * cross(u1, u2);
  s.flipped = !(signed_area > 0);
  if (s.flipped || !(s.area > 0)) return s;
  const double x2 = e1.dot(e2) / length, y2 = 2 * s.area / length;
  const Eigen::RowVector2d a = u1 / length, b = (u2 - x2 * a) / y2;
  s.trace = a.squaredNorm() + b.squaredNorm();
  s.det = signed_area / s.area;
  return s;
}

}  // namespace

Eigen::VectorXd signed_areas(const TexCoords& uv, const Faces& F) {
  Eigen::VectorXd areas(F.rows());
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    areas[f] = cross(uv.row(F(f, 1)) - uv.row(F(f, 0)), uv.row(F(f, 2)) - uv.row(F(f, 0)));
  return areas;
}

UvDistortion measure_distortion(const Vertices& V, const Faces& F, const TexCoords& uv) {
  if (uv.rows() != V.rows()) throw InvalidInput("distortion: needs one texture coordinate per vertex");
  std::vector<Stretch> all;
  double surface = 0, plane = 0;
  UvDistortion result;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const int i = F(f, 0), j = F(f, 1), k = F(f, 2);
    const Stretch s =
        stretch_of(V.row(j) - V.row(i), V.row(k) - V.row(i), uv.row(j) - uv.row(i), uv.row(k) - uv.row(i));
    if (s.flipped) {
      ++result.flips;
      continue;
    }
    if (!(s.area > 0)) continue;  // no shape to keep
    surface += s.area;
    plane += s.area * s.det;
    all.push_back(s);
  }
  if (all.empty()) return result;
  const double scale2 = surface / plane;  // squares of lengths
  for (const Stretch& s : all) {
    const double w = s.area / surface, trace = s.trace * scale2, det = s.det * scale2;
    const double inverse = trace / (det * det);  // 1/s1^2 + 1/s2^2
    const double s2 = std::sqrt(std::max(0.0, 0.5 * (trace - std::sqrt(std::max(0.0, trace * trace - 4 * det * det)))));
    result.l2 += w * inverse / 2;
    result.conformal += w * trace / (2 * det);
    result.symmetric_dirichlet += w * (trace + inverse) / 4;
    result.area += w * (det + 1 / det) / 2;
    result.linf = std::max(result.linf, 1 / s2);
  }
  result.l2 = std::sqrt(result.l2);
  return result;
}

double overlap_share(const TexCoords& uv, const Faces& F, int size) {
  std::vector<unsigned char> hits(static_cast<size_t>(size) * static_cast<size_t>(size), 0);
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const Eigen::RowVector2d a = uv.row(F(f, 0)) * size, b = uv.row(F(f, 1)) * size, c = uv.row(F(f, 2)) * size;
    const double area = cross(b - a, c - a);
    if (area == 0) continue;
    const auto first = [size](double x) { return std::clamp(static_cast<int>(std::floor(x)), 0, size - 1); };
    const Eigen::RowVector2d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
    for (int y = first(low.y()); y <= first(high.y()); ++y)
      for (int x = first(low.x()); x <= first(high.x()); ++x) {
        const Eigen::RowVector2d p(x + 0.5, y + 0.5);
        const double s = area > 0 ? 1 : -1;
        if (s * cross(b - a, p - a) > 0 && s * cross(c - b, p - b) > 0 && s * cross(a - c, p - c) > 0) {
          auto& count = hits[static_cast<size_t>(y) * static_cast<size_t>(size) + static_cast<size_t>(x)];
          if (count < 2) ++count;
        }
      }
  }
  const auto covered = hits.size() - static_cast<size_t>(std::count(hits.begin(), hits.end(), 0));
  const auto twice = std::count(hits.begin(), hits.end(), 2);
  return covered ? static_cast<double>(twice) / static_cast<double>(covered) : 0;
}

}  // namespace facewright
