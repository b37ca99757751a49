// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/core/random.h"
#include "libmodel/core/topology.h"

// A scanned surface whose every point is known: the front of a head-sized ellipsoid with bumps.
namespace facewright {

/// A Gaussian bump; its height equals its standard deviation.
struct PlantedBump {
  Eigen::Vector3d direction;
  double size;  ///< mm
};

inline Eigen::Vector3d direction_of(double longitude_deg, double latitude_deg) {
  const double a = longitude_deg * std::numbers::pi / 180, b = latitude_deg * std::numbers::pi / 180;
  return {std::sin(a) * std::cos(b), std::sin(b), std::cos(a) * std::cos(b)};
}

inline const std::vector<PlantedBump>& planted_bumps() {
  static const std::vector<PlantedBump> bumps = [] {
    std::vector<PlantedBump> b;
    for (const double a : {-42, 42}) b.push_back({direction_of(a, 24), 12});
    for (const double a : {-55, -18, 18, 55}) b.push_back({direction_of(a, -14), 6});
    for (const double a : {-60, -40, -20, 0, 20, 40, 60}) b.push_back({direction_of(a, -38), 3});
    return b;
  }();
  return bumps;
}

inline double ellipsoid_radius(const Eigen::Vector3d& unit) {
  return 1 / Eigen::Vector3d(unit.x() / 75, unit.y() / 105, unit.z() / 95).norm();
}

/// Distance of the surface from the origin along a unit direction.
inline double planted_radius(const Eigen::Vector3d& unit) {
  double r = ellipsoid_radius(unit);
  for (const PlantedBump& b : planted_bumps()) {
    const double chord = (unit - b.direction).norm() * ellipsoid_radius(b.direction) / b.size;
    if (chord < 7) r += b.size * std::exp(-0.5 * chord * chord);
  }
  return r;
}

/// Outward unit normal of the surface above a point, by central differences.
inline Eigen::Vector3d planted_normal(const Eigen::Vector3d& p) {
  const Eigen::Vector3d d = p.normalized(), t1 = d.unitOrthogonal(), t2 = d.cross(t1);
  const auto at = [](const Eigen::Vector3d& v) {
    return Eigen::Vector3d(planted_radius(v.normalized()) * v.normalized());
  };
  const double h = 1e-4;
  return (at(d + h * t1) - at(d - h * t1)).cross(at(d + h * t2) - at(d - h * t2)).normalized();
}

/// Signed distance of a point from the surface, right to first order in that distance.
inline double planted_distance(const Eigen::Vector3d& p) {
  return (p.norm() - planted_radius(p.normalized())) * p.normalized().dot(planted_normal(p));
}

/// The surface as a scanner sees it: about `spacing` mm between vertices, irregular, 150 x 120 degrees.
inline Mesh planted_surface(double spacing, std::uint64_t seed) {
  const int columns = static_cast<int>(150 * std::numbers::pi / 180 * 88 / spacing);
  const int rows = static_cast<int>(120 * std::numbers::pi / 180 * 100 / spacing);
  Random random(seed);
  Mesh m;
  m.V.resize(static_cast<Eigen::Index>((columns + 1) * (rows + 1)), 3);
  for (int r = 0; r <= rows; ++r)
    for (int c = 0; c <= columns; ++c) {
      const double a = -75 + 150 * (c + random.uniform(-0.25, 0.25)) / columns;
      const double b = -60 + 120 * (r + random.uniform(-0.25, 0.25)) / rows;
      const Eigen::Vector3d d = direction_of(a, b);
      m.V.row(r * (columns + 1) + c) = planted_radius(d) * d;
    }
  m.F.resize(static_cast<Eigen::Index>(2 * columns * rows), 3);
  for (int r = 0, f = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const int i = r * (columns + 1) + c, j = i + columns + 1;
      if (random.uniform() < 0.5) {
        m.F.row(f++) << i, i + 1, j + 1;
        m.F.row(f++) << i, j + 1, j;
      } else {
        m.F.row(f++) << i, i + 1, j;
        m.F.row(f++) << i + 1, j + 1, j;
      }
    }
  return m;
}

/// Independent noise along the true normals, sigma in millimetres.
inline void plant_noise(Mesh& m, double sigma, std::uint64_t seed) {
  Random random(seed);
  for (Eigen::Index i = 0; i < m.V.rows(); ++i)
    m.V.row(i) += sigma * random.normal() * planted_normal(m.V.row(i)).transpose();
}

/// Moves vertices 4 to 20 mm along the true normals, `share` of all on their own and `clusters` groups of 2 to 12
/// neighbours, each group to one side; returns a flag per vertex.
inline std::vector<char> plant_spikes(Mesh& m, double share, int clusters, std::uint64_t seed) {
  Random random(seed);
  const int n = static_cast<int>(m.V.rows());
  std::vector<char> spike(static_cast<size_t>(n), 0);
  std::vector<double> height(static_cast<size_t>(n), 0);
  const auto plant = [&](int i, double h) {
    if (spike[static_cast<size_t>(i)]) return;
    spike[static_cast<size_t>(i)] = 1, height[static_cast<size_t>(i)] = h;
  };
  for (int i = 0; i < n; ++i)
    if (random.uniform() < share) plant(i, (random.uniform() < 0.5 ? -1 : 1) * random.uniform(4, 20));
  const Adjacency ring = vertex_neighbours(n, m.F);
  for (int k = 0; k < clusters; ++k) {
    std::vector<int> group = {random.index(n)};
    const size_t size = static_cast<size_t>(2 + random.index(11));
    const double side = random.uniform() < 0.5 ? -1 : 1;
    while (group.size() < size) {
      const int from = group[static_cast<size_t>(random.index(static_cast<int>(group.size())))];
      const int next = ring.begin(from)[random.index(ring.degree(from))];
      if (std::find(group.begin(), group.end(), next) == group.end()) group.push_back(next);
    }
    for (const int i : group) plant(i, side * random.uniform(4, 20));
  }
  for (int i = 0; i < n; ++i)
    if (spike[static_cast<size_t>(i)])
      m.V.row(i) += height[static_cast<size_t>(i)] * planted_normal(m.V.row(i)).transpose();
  return spike;
}

/// Share of a bump's height that is missing: least-squares height of the bump's own profile in the vertices' radii
/// within its size of the peak, the ellipsoid taken off.
inline double bump_loss(const Vertices& V, const PlantedBump& b) {
  double own = 0, product = 0;
  for (Eigen::Index i = 0; i < V.rows(); ++i) {
    const Eigen::Vector3d p = V.row(i), d = p.normalized();
    const double chord = (d - b.direction).norm() * ellipsoid_radius(b.direction) / b.size;
    if (chord > 1) continue;
    const double profile = b.size * std::exp(-0.5 * chord * chord);
    own += profile * profile;
    product += profile * (p.norm() - ellipsoid_radius(d));
  }
  return 1 - product / own;
}

/// Mean loss over the planted bumps of one size.
inline double mean_bump_loss(const Vertices& V, double size) {
  double sum = 0;
  int n = 0;
  for (const PlantedBump& b : planted_bumps())
    if (b.size == size) sum += bump_loss(V, b), ++n;
  return sum / n;
}

}  // namespace facewright
