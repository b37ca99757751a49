// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/render/projection.h"

namespace facewright {

/// A function of the pixel that is linear over a triangle: start at its first corner, slopes in x and y.
struct ScreenPlane {
  double value = 0, dx = 0, dy = 0;
};

/// Barycentric coordinates b1, b2 of a triangle on the screen (b0 = 1 - b1 - b2) as planes over its first corner.
struct BarycentricPlanes {
  double x0 = 0, y0 = 0;
  double b1_dx = 0, b1_dy = 0, b2_dx = 0, b2_dy = 0;  ///< 0 for triangles without area
  double area2 = 0;                                   ///< twice the signed area, negative: counter-clockwise seen

  BarycentricPlanes(const TexCoords& p, int a, int b, int c) : x0(p(a, 0)), y0(p(a, 1)) {
    const double ux = p(b, 0) - x0, uy = p(b, 1) - y0, vx = p(c, 0) - x0, vy = p(c, 1) - y0;
    area2 = ux * vy - uy * vx;
    // Slivers have no pixel centre well inside; extrapolating from them would only amplify rounding.
    if (!(std::abs(area2) > 1e-9)) return;
    const double inverse = 1 / area2;
    b1_dx = vy * inverse, b1_dy = -vx * inverse, b2_dx = -uy * inverse, b2_dy = ux * inverse;
  }
  double b1(double x, double y) const { return b1_dx * (x - x0) + b1_dy * (y - y0); }
  double b2(double x, double y) const { return b2_dx * (x - x0) + b2_dy * (y - y0); }
  /// The plane through values at the corners.
  ScreenPlane plane(double a, double b, double c) const {
    return {a, b1_dx * (b - a) + b2_dx * (c - a), b1_dy * (b - a) + b2_dy * (c - a)};
  }
  double at(const ScreenPlane& q, double x, double y) const { return q.value + q.dx * (x - x0) + q.dy * (y - y0); }
};

/// A triangle ready to be walked row by row. A pixel is in it if its centre is; of two triangles at an edge exactly one
/// has a centre that lies on it: each edge is crossed at one number per row, computed from its upper end for both, the
/// left one of a span included, the right one not; rows likewise from the top (the top-left rule).
class ScanTriangle {
 public:
  int id = -1, first_row = 0, last_row = -1;

  /// Rows outside [0, height) are cut; the triangle is empty (last_row < first_row) if none are left.
  ScanTriangle(int f, std::array<Eigen::Vector2d, 3> c, double area2, int height) : id(f) {
    std::array<int, 3> by_y = {0, 1, 2};
    const auto below = [&](int i, int j) { return c[at(i)][1] > c[at(j)][1]; };
    if (below(by_y[0], by_y[1])) std::swap(by_y[0], by_y[1]);
    if (below(by_y[1], by_y[2])) std::swap(by_y[1], by_y[2]);
    if (below(by_y[0], by_y[1])) std::swap(by_y[0], by_y[1]);
    const Eigen::Vector2d &top = c[at(by_y[0])], &middle = c[at(by_y[1])], &bottom = c[at(by_y[2])];
    first_row = ceil_in(top[1], height), last_row = ceil_in(bottom[1], height) - 1;
    if (last_row < first_row) return;
    // Positive area, even order: the middle corner lies to the right of the long edge, y being down.
    const bool even = at(by_y[1]) == (at(by_y[0]) + 1) % 3;
    long_left_ = (area2 > 0) == even;
    long_ = Edge(top, bottom), upper_ = Edge(top, middle), lower_ = Edge(middle, bottom);
  }

  /// Pixels [first, last) of row y, cut to [0, width).
  std::pair<int, int> span(int y, int width) const {
    const double a = long_.crossing(y), b = (y < lower_.y ? upper_ : lower_).crossing(y);
    return long_left_ ? std::pair(ceil_in(a, width), ceil_in(b, width))
                      : std::pair(ceil_in(b, width), ceil_in(a, width));
  }

 private:
  struct Edge {
    double x = 0, y = 0, slope = 0;
    Edge() = default;
    Edge(const Eigen::Vector2d& a, const Eigen::Vector2d& b)
        : x(a[0]), y(a[1]), slope(b[1] > a[1] ? (b[0] - a[0]) / (b[1] - a[1]) : 0) {}
    double crossing(double row) const { return x + (row - y) * slope; }
  };
  static constexpr size_t at(int i) { return static_cast<size_t>(i); }
  /// ceil(x) within [0, size], without a library call.
  static int ceil_in(double x, int size) {
    const double cut = x > 0 ? (x < size ? x : size) : 0;
    const int i = static_cast<int>(cut);
    return i + (i < cut);
  }

  Edge long_, upper_, lower_;
  bool long_left_ = false;
};

/// Triangles ready for the z-buffer, in the order of F. `z` is linear on the screen and larger is nearer.
struct ScanList {
  struct Item {
    ScanTriangle scan;
    ScreenPlane z;
    double x0, y0;
  };
  std::vector<Item> items;
};

/// Those that can be seen on a screen of `height` rows: corners finite and within a billion pixels, an area, and, if
/// asked for, turned to the camera.
ScanList scan_list(const ProjectedVertices& p, const Faces& F, int height, bool cull_backfaces);

/// Some rows of a visibility buffer: per pixel the nearest triangle (-1: none) and its z.
class VisibilityRows {
 public:
  /// Columns [left, right) of rows [first, first + count), empty.
  void clear(int left, int right, int first, int count);
  /// Equal z stays with the one drawn first.
  void draw(const ScanList::Item& item, int width) { draw(item, width, first_, last_row()); }
  /// The same, in rows [from, to] only: a large buffer is filled band by band, which stays in the cache.
  void draw(const ScanList::Item& item, int width, int from, int to) { draw<true>(item, width, from, to); }
  /// Of the z alone; triangles() must not be asked for.
  void clear_depth(int left, int right, int first, int count);
  void draw_depth(const ScanList::Item& item, int width, int from, int to) { draw<false>(item, width, from, to); }

  const int* triangles(int y) const { return triangle_.data() + offset(y); }  ///< of column left()
  const float* z(int y) const { return z_.data() + offset(y); }
  int left() const { return left_; }
  int right() const { return right_; }
  int first_row() const { return first_; }
  int last_row() const { return first_ + count_ - 1; }

 private:
  template <bool with_triangles>
  void draw(const ScanList::Item& item, int width, int from, int to);
  size_t offset(int y) const { return static_cast<size_t>(y - first_) * static_cast<size_t>(right_ - left_); }
  int left_ = 0, right_ = 0, first_ = 0, count_ = 0;
  std::vector<int> triangle_;
  std::vector<float> z_;
};

/// The list's items per band of `band_rows` rows, each in the order of the list.
std::vector<std::vector<int>> bands_of(const ScanList& list, int height, int band_rows);

/// The pixel box [left, right) x [top, bottom) of the points inside the screen.
struct PixelBox {
  int left = 0, right = 0, top = 0, bottom = 0;
};
PixelBox pixel_box(const TexCoords& pixels, int width, int height);

/// Calls body(triangle, x_first, x_last) for each run of one triangle in a row, x_last excluded, columns of the screen.
template <typename Body>
void for_each_run(const VisibilityRows& rows, int y, const Body& body) {
  const int* ids = rows.triangles(y);
  const int n = rows.right() - rows.left();
  for (int x = 0; x < n;) {
    const int id = ids[x];
    int end = x + 1;
    while (end < n && ids[end] == id) ++end;
    if (id >= 0) body(id, rows.left() + x, rows.left() + end);
    x = end;
  }
}

/// Throws InvalidInput unless F indexes 0..rows-1.
void check_raster_indices(const Faces& F, Eigen::Index rows);
/// Throws InvalidInput unless both are 1..32768.
void check_raster_size(int width, int height);

}  // namespace facewright
