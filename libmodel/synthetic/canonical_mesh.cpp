// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/synthetic/canonical_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/core/topology.h"
#include "libmodel/synthetic/mean_head.h"

namespace facewright {
namespace {

using Eigen::Vector3d;

constexpr double neck_cut = -150;

/// An interval sampled at `spacing`; outside it the spacing grows by a tenth of the distance.
struct Zone {
  double lo, hi, spacing;
};

/// Grid planes from `first` to beyond `last`, as dense as the densest zone asks.
std::vector<double> graded_planes(double first, double last, const std::vector<Zone>& zones, double coarse) {
  std::vector<double> planes{first};
  while (planes.back() < last) {
    double step = coarse;
    for (const Zone& z : zones) {
      const double outside = std::max({z.lo - planes.back(), planes.back() - z.hi, 0.0});
      step = std::min(step, z.spacing + 0.1 * outside);
    }
    planes.push_back(planes.back() + step);
  }
  return planes;
}

/// Samples of the distance on a rectilinear grid of the half head x >= -h/2; the first cell column straddles x = 0.
class HalfGrid {
 public:
  HalfGrid(const CanonicalMeshOptions& o) {
    const double f = o.fine_spacing, c = o.coarse_spacing;
    const double ear = std::min(1.5 * f, c);
    x_ = graded_planes(-f / 2, 96, {{-f / 2, 38, f}, {66, 90, ear}}, c);
    y_ = graded_planes(neck_cut - 2, 118, {{-80, 26, f}, {-8, 9, std::max(0.7 * f, 0.5)}}, c);
    z_ = graded_planes(-142, 84, {{22, 84, f}, {-78, -40, ear}}, c);
    sample(o.threads);
    simplify();
  }

  int nx() const { return static_cast<int>(x_.size()); }
  int ny() const { return static_cast<int>(y_.size()); }
  int nz() const { return static_cast<int>(z_.size()); }
  double value(int i, int j, int k) const { return values_[index(i, j, k)]; }
  Vector3d point(int i, int j, int k) const { return {x_[at(i)], y_[at(j)], z_[at(k)]}; }
  size_t index(int i, int j, int k) const { return (at(i) * y_.size() + at(j)) * z_.size() + at(k); }

 private:
  static size_t at(int i) { return static_cast<size_t>(i); }

  /// Coarse samples first; a fine one only where the surface can be near.
  void sample(int threads) {
    values_.assign(x_.size() * y_.size() * z_.size(), 0);
    constexpr int B = 6;
    const int bx = (nx() + B - 1) / B, by = (ny() + B - 1) / B, bz = (nz() + B - 1) / B;
    parallel_for(bx * by, threads, [&](int block) {
      for (int b = 0; b < bz; ++b) sample_block(block / by * B, block % by * B, b * B, B);
    });
  }
  void sample_block(int i0, int j0, int k0, int size) {
    const int i1 = std::min(i0 + size, nx()), j1 = std::min(j0 + size, ny()), k1 = std::min(k0 + size, nz());
    const Vector3d a = point(i0, j0, k0), b = point(i1 - 1, j1 - 1, k1 - 1);
    const double middle = mean_head_distance(0.5 * (a + b)), reach = 0.5 * (b - a).norm();
    const bool far = std::abs(middle) > 1.6 * reach + 5;
    for (int i = i0; i < i1; ++i)
      for (int j = j0; j < j1; ++j)
        for (int k = k0; k < k1; ++k) values_[index(i, j, k)] = far ? middle : mean_head_distance(point(i, j, k));
  }

  /// Flips the weakest corner of every cell that more than one sheet would cross, so that the net is manifold.
  void simplify() {
    for (bool changed = true; changed;) {
      changed = false;
      for (int i = 0; i + 1 < nx(); ++i)
        for (int j = 0; j + 1 < ny(); ++j)
          for (int k = 0; k + 1 < nz(); ++k) changed |= simplify_cell(i, j, k);
    }
  }
  bool simplify_cell(int i, int j, int k) {
    std::array<size_t, 8> corners;
    unsigned inside = 0;
    for (unsigned c = 0; c < 8; ++c) {
      corners[c] = index(i + static_cast<int>(c & 1), j + static_cast<int>(c >> 1 & 1), k + static_cast<int>(c >> 2));
      inside |= (values_[corners[c]] < 0 ? 1U : 0U) << c;
    }
    if (hangs_together(inside) && hangs_together(~inside & 255U)) return false;
    const unsigned split = hangs_together(inside) ? ~inside & 255U : inside;
    size_t weakest = 8;
    for (unsigned c = 0; c < 8; ++c)
      if ((split >> c & 1U) && (weakest == 8 || std::abs(values_[corners[c]]) < std::abs(values_[corners[weakest]])))
        weakest = c;
    double& value = values_[corners[weakest]];
    value = value < 0 ? 1e-3 : -1e-3;
    return true;
  }
  /// Whether the marked corners of a cube are connected along its edges.
  static bool hangs_together(unsigned marked) {
    unsigned reached = marked & (~marked + 1);
    for (int round = 0; round < 7; ++round)
      reached |= marked & ((reached & 0x55U) << 1 | (reached & 0xaaU) >> 1 | (reached & 0x33U) << 2 |
                           (reached & 0xccU) >> 2 | reached << 4 | reached >> 4);
    return reached == marked;
  }

  std::vector<double> x_, y_, z_, values_;
};

struct Net {
  std::vector<Vector3d> points;
  std::vector<std::array<int, 4>> quads;
  std::vector<bool> midline;
};

/// One vertex per cell the surface crosses, at the mean of the crossings of its edges.
class NetBuilder {
 public:
  explicit NetBuilder(const HalfGrid& grid) : g_(grid), cell_(static_cast<size_t>(g_.nx()) * g_.ny() * g_.nz(), -1) {
    for (int i = 0; i + 1 < g_.nx(); ++i)
      for (int j = 0; j + 1 < g_.ny(); ++j)
        for (int k = 0; k + 1 < g_.nz(); ++k) add_vertex(i, j, k);
    for (int i = 0; i < g_.nx(); ++i)
      for (int j = 0; j < g_.ny(); ++j)
        for (int k = 0; k < g_.nz(); ++k) add_quads(i, j, k);
  }
  Net take() { return std::move(net_); }

 private:
  void add_vertex(int i, int j, int k) {
    Vector3d sum = Vector3d::Zero();
    int crossings = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (int e = 0; e < 4; ++e) {
        std::array<int, 3> a{i, j, k};
        a[static_cast<size_t>((axis + 1) % 3)] += e & 1;
        a[static_cast<size_t>((axis + 2) % 3)] += e >> 1;
        std::array<int, 3> b = a;
        ++b[static_cast<size_t>(axis)];
        const double da = g_.value(a[0], a[1], a[2]), db = g_.value(b[0], b[1], b[2]);
        if ((da < 0) == (db < 0)) continue;
        const double t = da / (da - db);
        sum += (1 - t) * g_.point(a[0], a[1], a[2]) + t * g_.point(b[0], b[1], b[2]);
        ++crossings;
      }
    if (crossings == 0) return;
    cell_[g_.index(i, j, k)] = static_cast<int>(net_.points.size());
    net_.points.push_back(sum / crossings);
    net_.midline.push_back(i == 0);
    if (i == 0) net_.points.back().x() = 0;
  }

  int cell(int i, int j, int k) const {
    if (i < 0 || j < 0 || k < 0) return -1;
    return cell_[g_.index(i, j, k)];
  }

  /// Quads around the three grid edges that leave (i, j, k) upwards.
  void add_quads(int i, int j, int k) {
    const bool inside = g_.value(i, j, k) < 0;
    const auto add = [&](bool end_inside, std::array<int, 4> q) {
      if (inside == end_inside || std::any_of(q.begin(), q.end(), [](int v) { return v < 0; })) return;
      if (!inside) std::swap(q[1], q[3]);
      net_.quads.push_back(q);
    };
    if (i > 0 && i + 1 < g_.nx())
      add(g_.value(i + 1, j, k) < 0, {cell(i, j - 1, k - 1), cell(i, j, k - 1), cell(i, j, k), cell(i, j - 1, k)});
    if (i > 0 && j + 1 < g_.ny())
      add(g_.value(i, j + 1, k) < 0, {cell(i - 1, j, k - 1), cell(i - 1, j, k), cell(i, j, k), cell(i, j, k - 1)});
    if (i > 0 && k + 1 < g_.nz())
      add(g_.value(i, j, k + 1) < 0, {cell(i - 1, j - 1, k), cell(i, j - 1, k), cell(i, j, k), cell(i - 1, j, k)});
    if (i == 0 && i + 1 < g_.nx())
      add(g_.value(i + 1, j, k) < 0, {cell(i, j - 1, k - 1), cell(i, j, k - 1), cell(i, j, k), cell(i, j - 1, k)});
  }

  const HalfGrid& g_;
  std::vector<int> cell_;
  Net net_;
};

/// Tangential relaxation evens the net out; projection returns it to the surface.
void relax(Net& net, int rounds, int threads) {
  const int n = static_cast<int>(net.points.size());
  std::vector<std::vector<int>> around(net.points.size());
  for (const auto& q : net.quads)
    for (size_t c = 0; c < 4; ++c) {
      around[static_cast<size_t>(q[c])].push_back(q[(c + 1) % 4]);
      around[static_cast<size_t>(q[c])].push_back(q[(c + 3) % 4]);
    }
  for (int round = 0; round <= rounds; ++round) {
    const std::vector<Vector3d> old = net.points;
    parallel_for(n, threads, [&](int i) {
      const auto u = static_cast<size_t>(i);
      Vector3d p = old[u];
      if (round > 0 && !around[u].empty()) {
        Vector3d mean = Vector3d::Zero();
        for (int v : around[u]) mean += old[static_cast<size_t>(v)];
        p = 0.4 * p + 0.6 * mean / static_cast<double>(around[u].size());
        if (net.midline[u]) p.x() = 0;
      }
      const int steps = round == rounds ? 4 : 1;
      for (int s = 0; s < steps; ++s) {
        const double d = mean_head_distance(p);
        if (std::abs(d) < 1e-7) break;
        const Vector3d g = mean_head_gradient(p);
        p -= std::clamp(d / std::max(g.squaredNorm(), 0.1), -1.0, 1.0) * g;
        if (net.midline[u]) p.x() = 0;
      }
      net.points[u] = p;
    });
  }
}

/// Both halves; quads split along the shorter diagonal; only what hangs together with the face; cut at the neck.
CanonicalMesh mirror_halves(const Net& net) {
  const int n = static_cast<int>(net.points.size());
  std::vector<std::array<int, 3>> half;
  const auto P = [&](int v) -> const Vector3d& { return net.points[static_cast<size_t>(v)]; };
  for (const auto& q : net.quads) {
    if (std::any_of(q.begin(), q.end(), [&](int v) { return P(v).y() < neck_cut; })) continue;
    if ((P(q[0]) - P(q[2])).norm() <= (P(q[1]) - P(q[3])).norm()) {
      half.push_back({q[0], q[1], q[2]});
      half.push_back({q[0], q[2], q[3]});
    } else {
      half.push_back({q[1], q[2], q[3]});
      half.push_back({q[1], q[3], q[0]});
    }
  }
  Faces all(static_cast<Eigen::Index>(half.size()), 3);
  for (size_t f = 0; f < half.size(); ++f) all.row(static_cast<Eigen::Index>(f)) << half[f][0], half[f][1], half[f][2];
  const Components parts = connected_components(n, all);
  int seed = 0;  // the foremost vertex: the tip of the nose
  for (int v = 0; v < n; ++v)
    if (P(v).z() > P(seed).z()) seed = v;
  const int label = parts.vertex_label[static_cast<size_t>(seed)];
  std::vector<int> left(net.points.size(), -1), right(net.points.size(), -1);
  CanonicalMesh result;
  std::vector<Vector3d> vertices;
  for (const auto& t : half)
    for (int v : t) {
      const auto u = static_cast<size_t>(v);
      if (parts.vertex_label[u] != label || left[u] >= 0) continue;
      left[u] = right[u] = static_cast<int>(vertices.size());
      vertices.push_back(P(v));
      if (net.midline[u]) {
        result.mirror.push_back(left[u]);
        continue;
      }
      right[u] = left[u] + 1;
      vertices.emplace_back(-P(v).x(), P(v).y(), P(v).z());
      result.mirror.push_back(right[u]);
      result.mirror.push_back(left[u]);
    }
  std::vector<std::array<int, 3>> faces;
  for (const auto& t : half) {
    if (parts.vertex_label[static_cast<size_t>(t[0])] != label) continue;
    const auto l = [&](size_t c) { return left[static_cast<size_t>(t[c])]; };
    const auto r = [&](size_t c) { return right[static_cast<size_t>(t[c])]; };
    faces.push_back({l(0), l(1), l(2)});
    faces.push_back({r(0), r(2), r(1)});
  }
  Mesh& mesh = result.mesh;
  mesh.V.resize(static_cast<Eigen::Index>(vertices.size()), 3);
  for (size_t v = 0; v < vertices.size(); ++v) mesh.V.row(static_cast<Eigen::Index>(v)) = vertices[v].transpose();
  mesh.F.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (size_t f = 0; f < faces.size(); ++f)
    mesh.F.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  return result;
}

}  // namespace

CanonicalMesh extract_mean_head(const CanonicalMeshOptions& o) {
  if (!(o.fine_spacing >= 0.5 && o.fine_spacing <= 4))
    throw InvalidInput("extract_mean_head: fine_spacing must be 0.5 .. 4 mm, not " + std::to_string(o.fine_spacing));
  if (!(o.coarse_spacing >= o.fine_spacing && o.coarse_spacing <= 8))
    throw InvalidInput("extract_mean_head: coarse_spacing must be fine_spacing .. 8 mm, not " +
                       std::to_string(o.coarse_spacing));
  const HalfGrid grid(o);
  Net net = NetBuilder(grid).take();
  relax(net, 3, o.threads);
  return mirror_halves(net);
}

}  // namespace facewright
