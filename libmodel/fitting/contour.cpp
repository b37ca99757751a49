// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/contour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

/// The posed mesh in the pixels of a small depth buffer.
class PosedMesh {
 public:
  PosedMesh(const Vertices& V, const Faces& F, const AffineCamera& camera, const ContourOptions& options)
      : V_(V), F_(F), view_(camera.towards_camera()), bias_(options.depth_bias) {
    if (F.size() > 0 && (F.minCoeff() < 0 || F.maxCoeff() >= V.rows()))
      throw InvalidInput("contour: a triangle refers to a vertex outside 0.." + std::to_string(V.rows() - 1));
    if (options.depth_resolution < 1) throw InvalidInput("contour: expected depth_resolution >= 1");
    pixels_ = (V * camera.A.transpose()).rowwise() + camera.b.transpose();
    depth_ = V * view_;
    if (!pixels_.allFinite()) throw InvalidInput("contour: the posed mesh is not finite");
    find_front_faces();
    const Eigen::RowVector2d low = pixels_.colwise().minCoeff(), extent = pixels_.colwise().maxCoeff() - low;
    const double longer = extent.maxCoeff(), scale = longer > 0 ? (options.depth_resolution - 1) / longer : 1;
    small_ = ((pixels_.rowwise() - low) * scale).array().cast<float>();
    width_ = static_cast<int>(extent[0] * scale) + 2;
    height_ = static_cast<int>(extent[1] * scale) + 2;
  }

  /// Draws the front faces where is_visible() will look for one of the marked vertices.
  void fill_depth_buffer(const std::vector<char>& marked) {
    tiles_across_ = (width_ >> kTileBits) + 1;
    tile_wanted_.assign(static_cast<size_t>(tiles_across_ * ((height_ >> kTileBits) + 1)), 0);
    for (int v = 0; v < static_cast<int>(marked.size()); ++v) {
      if (!marked[static_cast<size_t>(v)]) continue;
      const auto [x, y] = cell(v);
      for (const int j : {std::max(y - 1, 0), std::min(y + 1, height_ - 1)})
        for (const int i : {std::max(x - 1, 0), std::min(x + 1, width_ - 1)}) tile_wanted_[tile(i, j)] = 1;
    }
    buffer_.assign(static_cast<size_t>(width_ * height_), -std::numeric_limits<float>::infinity());
    for (Eigen::Index f = 0; f < F_.rows(); ++f)
      if (front_[static_cast<size_t>(f)]) draw(F_(f, 0), F_(f, 2), F_(f, 1));  // clockwise in pixels
  }

  Eigen::Vector2d pixel(int v) const { return pixels_.row(v).transpose(); }
  bool is_front(int f) const { return front_[static_cast<size_t>(f)] != 0; }

  /// Not behind everything that is seen in the pixels around it.
  bool is_visible(int v) const {
    const auto [x, y] = cell(v);
    float farthest = std::numeric_limits<float>::infinity();
    for (int j = y - 1; j <= y + 1; ++j)
      for (int i = x - 1; i <= x + 1; ++i) {
        if (i < 0 || j < 0 || i >= width_ || j >= height_) return true;  // background is seen beside it
        farthest = std::min(farthest, buffer_[static_cast<size_t>(j * width_ + i)]);
      }
    return depth_[v] >= static_cast<double>(farthest) - bias_;
  }

  /// Sum of the incident triangles' normals (twice their area) for the marked vertices, in pixels.
  std::vector<Eigen::Vector2d> image_normals(const std::vector<char>& marked, const AffineCamera& camera) const {
    std::vector<Eigen::Vector2d> sum(marked.size(), Eigen::Vector2d::Zero());
    for (Eigen::Index f = 0; f < F_.rows(); ++f) {
      const int a = F_(f, 0), b = F_(f, 1), c = F_(f, 2);
      if (!marked[static_cast<size_t>(a)] && !marked[static_cast<size_t>(b)] && !marked[static_cast<size_t>(c)])
        continue;
      const Eigen::Vector3d u = V_.row(b) - V_.row(a), w = V_.row(c) - V_.row(a);
      const Eigen::Vector2d n = camera.A * u.cross(w);
      for (const int v : {a, b, c}) sum[static_cast<size_t>(v)] += n;
    }
    return sum;
  }

 private:
  void find_front_faces() {
    front_.resize(static_cast<size_t>(F_.rows()));
    for (Eigen::Index f = 0; f < F_.rows(); ++f) {
      const double* a = &pixels_(F_(f, 0), 0);
      const double* b = &pixels_(F_(f, 1), 0);
      const double* c = &pixels_(F_(f, 2), 0);
      // Counter-clockwise from outside is clockwise in pixels, because y runs down.
      front_[static_cast<size_t>(f)] = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) < 0;
    }
  }

  static constexpr int kTileBits = 3;  // tiles of 8 x 8 pixels

  size_t tile(int x, int y) const { return static_cast<size_t>((y >> kTileBits) * tiles_across_ + (x >> kTileBits)); }
  bool is_wanted(int x0, int y0, int x1, int y1) const {
    for (int y = y0 >> kTileBits; y <= y1 >> kTileBits; ++y)
      for (int x = x0 >> kTileBits; x <= x1 >> kTileBits; ++x)
        if (tile_wanted_[static_cast<size_t>(y * tiles_across_ + x)]) return true;
    return false;
  }

  /// Depth is linear over the triangle; pixels whose centre lies inside (borders included) keep the nearest.
  void draw(int ia, int ib, int ic) {
    const float *a = &small_(ia, 0), *b = &small_(ib, 0), *c = &small_(ic, 0);
    const int x0 = ceiling(std::min(std::min(a[0], b[0]), c[0])), y0 = ceiling(std::min(std::min(a[1], b[1]), c[1]));
    const auto x1 = static_cast<int>(std::max(std::max(a[0], b[0]), c[0]));
    const auto y1 = static_cast<int>(std::max(std::max(a[1], b[1]), c[1]));
    if (x0 > x1 || y0 > y1 || !is_wanted(x0, y0, x1, y1)) return;
    const float ux = b[0] - a[0], uy = b[1] - a[1], wx = c[0] - a[0], wy = c[1] - a[1], area = ux * wy - uy * wx;
    if (!(area > 0)) return;
    const auto za = static_cast<float>(depth_[ia]);
    const float zb = static_cast<float>(depth_[ib]) - za, zc = static_cast<float>(depth_[ic]) - za;
    const float per_area = 1 / area;
    for (int y = y0; y <= y1; ++y) {
      const float py = static_cast<float>(y) - a[1];
      float* row = buffer_.data() + y * width_;
      for (int x = x0; x <= x1; ++x) {
        const float px = static_cast<float>(x) - a[0];
        const float s = (px * wy - py * wx) * per_area, t = (ux * py - uy * px) * per_area;
        if (std::min(s, t) < 0 || s + t > 1) continue;
        row[x] = std::max(row[x], za + s * zb + t * zc);
      }
    }
  }

  /// Of a number >= 0, without a call of the library.
  static int ceiling(float x) {
    const int below = static_cast<int>(x);
    return below + (x > static_cast<float>(below) ? 1 : 0);
  }

  std::pair<int, int> cell(int v) const {
    return {static_cast<int>(small_(v, 0) + 0.5F), static_cast<int>(small_(v, 1) + 0.5F)};
  }

  const Vertices& V_;
  const Faces& F_;
  Eigen::Vector3d view_;
  double bias_;
  Pixels pixels_;
  Eigen::VectorXd depth_;
  std::vector<char> front_;
  Eigen::Matrix<float, Eigen::Dynamic, 2, Eigen::RowMajor> small_;
  int width_ = 0, height_ = 0;
  std::vector<float> buffer_;
  int tiles_across_ = 0;
  std::vector<char> tile_wanted_;
};

/// The same as occluding_vertices where every vertex has one fan of triangles, without the edges: whoever has
/// triangles to and from the camera has an edge between them.
std::vector<char> turning_vertices(const PosedMesh& mesh, const Faces& F, Eigen::Index vertices) {
  std::vector<char> sides(static_cast<size_t>(vertices), 0);  // 1: to the camera, 2: from it
  for (int f = 0; f < static_cast<int>(F.rows()); ++f) {
    const char side = mesh.is_front(f) ? 1 : 2;
    for (int k = 0; k < 3; ++k) sides[static_cast<size_t>(F(f, k))] |= side;
  }
  for (char& s : sides) s = s == 3;
  return sides;
}

/// Flags of the vertices on occluding edges.
std::vector<char> occluding_vertices(const PosedMesh& mesh, const std::vector<Edge>& E, Eigen::Index vertices) {
  std::vector<char> marked(static_cast<size_t>(vertices), 0);
  for (const Edge& e : E)
    if (!e.is_boundary() && mesh.is_front(e.f0) != mesh.is_front(e.f1))
      marked[static_cast<size_t>(e.v0)] = marked[static_cast<size_t>(e.v1)] = 1;
  return marked;
}

std::vector<OutlinePoint> visible_points(const PosedMesh& mesh, const std::vector<char>& marked,
                                         const AffineCamera& camera) {
  const std::vector<Eigen::Vector2d> normals = mesh.image_normals(marked, camera);
  std::vector<OutlinePoint> outline;
  for (size_t v = 0; v < marked.size(); ++v)
    if (const int vertex = static_cast<int>(v); marked[v] && normals[v].squaredNorm() > 0 && mesh.is_visible(vertex))
      outline.push_back({vertex, mesh.pixel(vertex), normals[v].normalized()});
  return outline;
}

bool in_reach(const Eigen::Vector2d& pixel, const OutlineSearch& search) {
  if (search.landmarks.rows() == 0) return true;
  const double limit = search.reach_px * search.reach_px;
  for (Eigen::Index k = 0; k < search.landmarks.rows(); ++k)
    if ((search.landmarks.row(k).transpose() - pixel).squaredNorm() <= limit) return true;
  return false;
}

/// Adds the visible vertices of a line; its own direction in the image gives the normals.
void add_line(std::vector<OutlinePoint>& outline, const std::vector<int>& line, const PosedMesh& mesh,
              std::vector<char>& taken) {
  for (size_t i = 0; i < line.size() && line.size() > 1; ++i) {
    const Eigen::Vector2d along =
        mesh.pixel(line[std::min(i + 1, line.size() - 1)]) - mesh.pixel(line[i > 0 ? i - 1 : 0]);
    char& is_taken = taken[static_cast<size_t>(line[i])];
    if (is_taken || !(along.norm() > 0) || !mesh.is_visible(line[i])) continue;
    is_taken = 1;
    outline.push_back({line[i], mesh.pixel(line[i]), Eigen::Vector2d(-along[1], along[0]).normalized()});
  }
}

}  // namespace

std::vector<OutlinePoint> visible_outline(const Vertices& V, const Faces& F, const std::vector<Edge>& E,
                                          const AffineCamera& camera, const ContourOptions& options) {
  PosedMesh mesh(V, F, camera, options);
  const std::vector<char> marked = occluding_vertices(mesh, E, V.rows());
  mesh.fill_depth_buffer(marked);
  return visible_points(mesh, marked, camera);
}

std::vector<OutlinePoint> jaw_outline(const Vertices& V, const Faces& F, const FaceContours& contours,
                                      const AffineCamera& camera, const ContourOptions& options,
                                      const OutlineSearch& search) {
  PosedMesh mesh(V, F, camera, options);
  std::vector<char> on_contours(static_cast<size_t>(V.rows()), 0);
  for (const auto* side : {&contours.right, &contours.left})
    for (const int v : *side) {
      if (v < 0 || v >= V.rows()) throw InvalidInput("contour: a contour names a vertex that does not exist");
      on_contours[static_cast<size_t>(v)] = 1;
    }
  std::vector<char> marked = turning_vertices(mesh, F, V.rows()), looked_at = on_contours;
  for (size_t v = 0; v < marked.size(); ++v) {
    if (!marked[v]) continue;
    marked[v] = (!options.only_contours || on_contours[v]) && in_reach(mesh.pixel(static_cast<int>(v)), search);
    looked_at[v] = looked_at[v] || marked[v];
  }
  mesh.fill_depth_buffer(looked_at);
  std::vector<OutlinePoint> outline = visible_points(mesh, marked, camera);
  std::vector<char> taken(marked.size(), 0);
  for (const OutlinePoint& p : outline) taken[static_cast<size_t>(p.vertex)] = 1;
  add_line(outline, contours.right, mesh, taken);
  add_line(outline, contours.left, mesh, taken);
  return outline;
}

std::vector<int> match_outline(const Pixels& pixels, const std::vector<OutlinePoint>& outline, double largest_px) {
  using Pair = std::tuple<double, int, int>;  // squared distance, landmark, outline point
  std::vector<Pair> pairs;
  for (Eigen::Index k = 0; k < pixels.rows(); ++k)
    for (size_t i = 0; i < outline.size(); ++i) {
      const double d = (pixels.row(k).transpose() - outline[i].pixel).squaredNorm();
      if (d <= largest_px * largest_px) pairs.emplace_back(d, static_cast<int>(k), static_cast<int>(i));
    }
  std::sort(pairs.begin(), pairs.end());
  std::vector<int> match(static_cast<size_t>(pixels.rows()), -1);
  std::vector<char> taken(outline.size(), 0);
  for (const auto& [d, k, i] : pairs) {
    if (match[static_cast<size_t>(k)] >= 0 || taken[static_cast<size_t>(i)]) continue;
    match[static_cast<size_t>(k)] = i;
    taken[static_cast<size_t>(i)] = 1;
  }
  return match;
}

}  // namespace facewright
