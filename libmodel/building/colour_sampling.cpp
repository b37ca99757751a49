// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/colour_sampling.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/geometry/normals.h"

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

// The taps of a disc: rings of 6, 12, 18, ... points, each for the same area, at most 1.5 texels from ring to ring.
Eigen::Vector3d disc_mean(const Image& texture, const Eigen::Vector2d& centre, double radius) {
  constexpr double kSpacing = 1.5;  // texels; a bilinear tap covers two
  constexpr int kMostRings = 24;
  Eigen::Vector3d sum = sample_linear(texture, centre);
  if (radius < 0.5) return sum;
  const int rings = std::clamp(static_cast<int>(std::ceil(radius / kSpacing)), 1, kMostRings);
  int taps = 1;
  for (int ring = 1; ring <= rings; ++ring)
    for (int k = 0; k < 6 * ring; ++k, ++taps) {
      const double a = (k + 0.5 * (ring % 2)) * std::numbers::pi / (3 * ring);
      sum += sample_linear(texture, centre + radius * ring / rings * Eigen::Vector2d(std::cos(a), std::sin(a)));
    }
  return sum / taps;
}

Eigen::Vector3d texture_colour(const Mesh& scan, const Image& texture, const SurfacePoint& p, double footprint) {
  const Corner uv = corner_uv(scan, p.triangle);
  const Eigen::RowVector2d t = p.barycentric.transpose() * uv;
  // Texel centres lie at (i + 0.5) / width; v runs up, rows run down.
  const Eigen::Vector2d centre(t[0] * texture.width - 0.5, (1 - t[1]) * texture.height - 0.5);
  return disc_mean(texture, centre, 0.5 * footprint * texel_density(scan, texture, p.triangle, uv));
}

// Mean of vertex colours over discs about points, by the vertices' areas.
class VertexColours {
 public:
  explicit VertexColours(const Mesh& scan)
      : scan_(scan), ring_(vertex_neighbours(scan.V.rows(), scan.F)), areas_(vertex_areas(scan.V, scan.F)) {}

  // Interpolated where the disc holds none of the vertices around the point's triangle.
  Eigen::Vector3d operator()(const NearestPoint& point, double footprint) {
    const Eigen::Vector3d here = position(point.where, scan_.colours, scan_.F);
    const Eigen::Vector3d centre = position(point.where, scan_.V, scan_.F);
    const double radius = 0.5 * footprint;
    const Eigen::Vector3d own(areas_[scan_.F(point.where.triangle, 0)], areas_[scan_.F(point.where.triangle, 1)],
                              areas_[scan_.F(point.where.triangle, 2)]);
    double weight = point.where.barycentric.dot(own);
    Eigen::Vector3d sum = weight * here;
    collect(point.where.triangle, centre, radius);
    for (const int v : within_) {
      sum += areas_[v] * scan_.colours.row(v).transpose();
      weight += areas_[v];
    }
    return weight > 0 && !within_.empty() ? Eigen::Vector3d(sum / weight) : here;
  }

 private:
  // Vertices within the radius that are reached over the surface from the triangle's corners.
  void collect(int triangle, const Eigen::Vector3d& centre, double radius) {
    within_.clear();
    const auto visit = [&](int v) {
      if ((scan_.V.row(v).transpose() - centre).squaredNorm() < radius * radius &&
          std::find(within_.begin(), within_.end(), v) == within_.end())
        within_.push_back(v);
    };
    for (int k = 0; k < 3; ++k) visit(scan_.F(triangle, k));
    for (size_t i = 0; i < within_.size() && within_.size() < kMost; ++i)
      for (const int* j = ring_.begin(within_[i]); j != ring_.end(within_[i]); ++j) visit(*j);
  }

  static constexpr size_t kMost = 400;
  const Mesh& scan_;
  Adjacency ring_;
  Eigen::VectorXd areas_;
  std::vector<int> within_;
};

}  // namespace

Colours sample_colours(const Mesh& scan, const Image& texture, const std::vector<NearestPoint>& points,
                       const Eigen::VectorXd& footprint) {
  if (footprint.size() != static_cast<Eigen::Index>(points.size()))
    throw InvalidInput("colour sampling: one footprint per point is needed");
  const bool textured = !texture.empty() && scan.has_uv();
  if (!textured && !scan.has_colours()) return {};
  Colours result(static_cast<Eigen::Index>(points.size()), 3);
  std::optional<VertexColours> vertex_colours;
  if (!textured) vertex_colours.emplace(scan);
  for (size_t i = 0; i < points.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    result.row(row) = (textured ? texture_colour(scan, texture, points[i].where, footprint[row])
                                : (*vertex_colours)(points[i], footprint[row]))
                          .transpose();
  }
  return result;
}

}  // namespace facewright
