// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "tests/support/shapes.h"

#include <Eigen/Geometry>
#include <map>
#include <numbers>
#include <vector>

namespace facewright {

namespace {

constexpr double kPi = std::numbers::pi;

// Cells of a (columns x rows) grid of vertices numbered row by row; columns wrap around when `closed`.
Faces grid_faces(int columns, int rows, bool closed) {
  const int stride = closed ? columns : columns + 1;
  Faces F(2 * columns * rows, 3);
  int f = 0;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const int a = r * stride + c, b = r * stride + (c + 1) % stride;
      F.row(f++) << a, b, b + stride;
      F.row(f++) << a, b + stride, a + stride;
    }
  return F;
}

// Midpoint of an edge on the unit sphere, made once per edge.
int edge_midpoint(int a, int b, std::vector<Eigen::Vector3d>& points, std::map<std::pair<int, int>, int>& known) {
  const auto [place, is_new] = known.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<int>(points.size()));
  if (is_new) points.push_back((points[static_cast<size_t>(a)] + points[static_cast<size_t>(b)]).normalized());
  return place->second;
}

std::vector<Eigen::Vector3i> split(const std::vector<Eigen::Vector3i>& triangles,
                                   std::vector<Eigen::Vector3d>& points) {
  std::map<std::pair<int, int>, int> known;
  std::vector<Eigen::Vector3i> finer;
  for (const Eigen::Vector3i& t : triangles) {
    const int ab = edge_midpoint(t[0], t[1], points, known), bc = edge_midpoint(t[1], t[2], points, known),
              ca = edge_midpoint(t[2], t[0], points, known);
    finer.insert(finer.end(), {{t[0], ab, ca}, {t[1], bc, ab}, {t[2], ca, bc}, {ab, bc, ca}});
  }
  return finer;
}

}  // namespace

Mesh plane_grid(int columns, int rows, double width, double height) {
  Mesh mesh;
  mesh.F = grid_faces(columns, rows, false);
  mesh.V.resize((columns + 1) * (rows + 1), 3);
  for (int r = 0; r <= rows; ++r)
    for (int c = 0; c <= columns; ++c) mesh.V.row(r * (columns + 1) + c) << width * c / columns, height * r / rows, 0;
  return mesh;
}

Mesh icosphere(int subdivisions, double radius) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  std::vector<Eigen::Vector3d> points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                                         {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (Eigen::Vector3d& p : points) p.normalize();
  std::vector<Eigen::Vector3i> triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                            {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                            {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                            {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int s = 0; s < subdivisions; ++s) triangles = split(triangles, points);
  Mesh mesh;
  mesh.V.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (size_t i = 0; i < points.size(); ++i) mesh.V.row(static_cast<Eigen::Index>(i)) = radius * points[i].transpose();
  mesh.F.resize(static_cast<Eigen::Index>(triangles.size()), 3);
  for (size_t f = 0; f < triangles.size(); ++f) mesh.F.row(static_cast<Eigen::Index>(f)) = triangles[f].transpose();
  return mesh;
}

Mesh hemisphere(int rings, int segments, double radius) {
  Mesh mesh;
  mesh.V.resize(1 + rings * segments, 3);
  mesh.V.row(0) << 0, 0, radius;
  for (int r = 1; r <= rings; ++r)
    for (int s = 0; s < segments; ++s) {
      const double polar = kPi / 2 * r / rings, around = 2 * kPi * s / segments;
      mesh.V.row(1 + (r - 1) * segments + s) << radius * std::sin(polar) * std::cos(around),
          radius * std::sin(polar) * std::sin(around), r == rings ? 0.0 : radius * std::cos(polar);
    }
  mesh.F.resize(segments + 2 * segments * (rings - 1), 3);
  for (int s = 0; s < segments; ++s) mesh.F.row(s) << 0, 1 + s, 1 + (s + 1) % segments;
  Faces bands = grid_faces(segments, rings - 1, true);
  bands.col(1).swap(bands.col(2));  // rings run outwards from the pole: the other way round
  mesh.F.bottomRows(bands.rows()) = bands.array() + 1;
  return mesh;
}

Mesh cylinder_patch(int columns, int rows, double radius, double half_angle, double height) {
  Mesh mesh = plane_grid(columns, rows, 2 * half_angle, height);
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i) {
    const double angle = mesh.V(i, 0) - half_angle;
    mesh.V.row(i) << radius * std::sin(angle), mesh.V(i, 1), radius * std::cos(angle);
  }
  return mesh;
}

Mesh annulus(int rings, int segments, double inner, double outer) {
  Mesh mesh;
  mesh.F = grid_faces(segments, rings, true);
  mesh.F.col(1).swap(mesh.F.col(2));  // rings run outwards
  mesh.V.resize((rings + 1) * segments, 3);
  for (int r = 0; r <= rings; ++r)
    for (int s = 0; s < segments; ++s) {
      const double radius = inner + (outer - inner) * r / rings, around = 2 * kPi * s / segments;
      mesh.V.row(r * segments + s) << radius * std::cos(around), radius * std::sin(around), 0;
    }
  return mesh;
}

Eigen::Matrix3d random_rotation(Random& random) {
  const double u = random.uniform(), a = 2 * kPi * random.uniform(), b = 2 * kPi * random.uniform();
  return Eigen::Quaterniond(std::sqrt(u) * std::cos(b), std::sqrt(1 - u) * std::sin(a), std::sqrt(1 - u) * std::cos(a),
                            std::sqrt(u) * std::sin(b))
      .toRotationMatrix();
}

Similarity random_similarity(Random& random, double shift) {
  Similarity T;
  T.s = std::exp2(random.uniform(-1, 1));
  T.R = random_rotation(random);
  for (double& t : T.t) t = random.uniform(-shift, shift);
  return T;
}

Vertices random_points(Random& random, Eigen::Index n, double sigma) {
  Vertices points(n, 3);
  for (double& x : points.reshaped()) x = sigma * random.normal();
  return points;
}

}  // namespace facewright
