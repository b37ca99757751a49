// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/denoise.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

double median(std::vector<double>& x) {
  if (x.empty()) return 0;
  const auto mid = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), mid, x.end());
  return *mid;
}

// What every stage needs of a scan's neighbourhoods.
struct Neighbourhoods {
  const Faces& F;
  Adjacency ring;
  std::vector<bool> boundary;

  explicit Neighbourhoods(const Mesh& m)
      : F(m.F), ring(vertex_neighbours(m.V.rows(), m.F)), boundary(boundary_vertices(m.V.rows(), m.F)) {}

  // Vertices within two edges of i, i excluded.
  void two_ring(int i, std::vector<int>* out) const {
    out->clear();
    for (const int* a = ring.begin(i); a != ring.end(i); ++a) {
      out->push_back(*a);
      for (const int* b = ring.begin(*a); b != ring.end(*a); ++b)
        if (*b != i) out->push_back(*b);
    }
    std::sort(out->begin(), out->end());
    out->erase(std::unique(out->begin(), out->end()), out->end());
  }
};

struct Quadric {
  double height = 0;  // at the centre, along the normal
  double spread = 0;  // variance factor of that height for unit noise
  bool valid = false;
};

// Weighted least squares of h = c0 + c1 u + c2 v + c3 u^2 + c4 uv + c5 v^2 about x along n.
Quadric fit_quadric(const Vertices& V, const std::vector<int>& points, const Eigen::RowVector3d& x,
                    const Eigen::RowVector3d& n, double width) {
  Quadric q;
  if (points.size() < 8) return q;
  const Eigen::Vector3d axis = n.transpose(), t1 = axis.unitOrthogonal(), t2 = axis.cross(t1);
  Eigen::Matrix<double, 6, 6> M = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> rhs = Eigen::Matrix<double, 6, 1>::Zero();
  const double unit = 1 / width;
  for (const int j : points) {
    const Eigen::Vector3d d = (V.row(j) - x).transpose() * unit;
    const double w = std::exp(-0.5 * d.squaredNorm());
    const double u = d.dot(t1), v = d.dot(t2);
    Eigen::Matrix<double, 6, 1> b;
    b << 1, u, v, u * u, u * v, v * v;
    M.selfadjointView<Eigen::Lower>().rankUpdate(b, w);
    rhs += w * d.dot(axis) * b;
  }
  M.diagonal().array() += 1e-9 * M.trace();
  const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> ldlt(M.selfadjointView<Eigen::Lower>());
  q.height = ldlt.solve(rhs)[0] * width;
  q.spread = ldlt.solve(Eigen::Matrix<double, 6, 1>::Unit(0))[0];
  q.valid = std::isfinite(q.height);
  return q;
}

double median_height(const Vertices& V, const std::vector<int>& points, const Eigen::RowVector3d& x,
                     const Eigen::RowVector3d& n, std::vector<double>* buffer) {
  buffer->clear();
  for (const int j : points) buffer->push_back(n.dot(V.row(j) - x));
  return median(*buffer);
}

// Mean normal of the one-ring, the vertex itself left out (a spike tilts its own normal).
Eigen::RowVector3d ring_normal(const Vertices& N, const std::vector<int>& points) {
  Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
  for (const int j : points) sum += N.row(j);
  const double length = sum.norm();
  return length > 1e-9 ? Eigen::RowVector3d(sum / length) : Eigen::RowVector3d::Zero();
}

double noise_of(const Vertices& V, const Vertices& N, const Neighbourhoods& hoods, double mean_edge) {
  constexpr int kSamples = 4000;
  const int n = static_cast<int>(V.rows()), step = std::max(1, n / kSamples);
  std::vector<double> r;
  std::vector<int> points;
  for (int i = 0; i < n; i += step) {
    if (hoods.boundary[i]) continue;
    hoods.two_ring(i, &points);
    const Eigen::RowVector3d normal = ring_normal(N, points);
    const Quadric q = fit_quadric(V, points, V.row(i), normal, 2 * mean_edge);
    // The quadric's own variance is about (sum of weights)^-1 of the noise; `spread` is that factor for unit weights.
    if (q.valid && normal.squaredNorm() > 0) r.push_back(std::abs(q.height) / std::sqrt(1 + q.spread));
  }
  return r.size() < 50 ? 0 : 1.4826 * median(r);
}

// Puts isolated vertices back among their neighbours; returns their indices.
std::vector<int> mend_spikes(Mesh& mesh, const Neighbourhoods& hoods, double noise, double mean_edge,
                             const DenoiseOptions& options) {
  Vertices& V = mesh.V;
  std::vector<bool> mended(static_cast<size_t>(V.rows()), false);
  std::vector<int> points, all;
  std::vector<double> buffer;
  for (int pass = 0; pass < 5; ++pass) {
    const Vertices N = vertex_normals(V, mesh.F);
    std::vector<std::pair<int, Eigen::RowVector3d>> moves;
    for (int i = 0; i < V.rows(); ++i) {
      if (hoods.ring.degree(i) < 3) continue;
      double shortest = 1e300;
      for (const int* j = hoods.ring.begin(i); j != hoods.ring.end(i); ++j)
        shortest = std::min(shortest, (V.row(*j) - V.row(i)).norm());
      if (shortest < options.spike_isolation * 0.5 * mean_edge) continue;  // cheap: most vertices end here
      hoods.two_ring(i, &points);
      buffer.clear();
      for (const int j : points)
        for (const int* k = hoods.ring.begin(j); k != hoods.ring.end(j); ++k)
          if (*k != i) buffer.push_back((V.row(*k) - V.row(j)).norm());
      if (shortest < options.spike_isolation * median(buffer)) continue;
      const Eigen::RowVector3d normal = ring_normal(N, points);
      const double h = median_height(V, points, V.row(i), normal, &buffer);
      if (std::abs(h) > std::max(options.spike_deviation * noise, 0.5 * mean_edge)) moves.emplace_back(i, h * normal);
    }
    if (moves.empty()) break;
    for (const auto& [i, d] : moves) V.row(i) += d, mended[i] = true;
  }
  for (int i = 0; i < V.rows(); ++i)
    if (mended[i]) all.push_back(i);
  return all;
}

// One pass of the chosen filter along the normals; returns the number of vertices moved.
int filter_pass(Mesh& mesh, const Neighbourhoods& hoods, double width, bool use_median) {
  const Vertices V = mesh.V, N = vertex_normals(V, mesh.F);
  std::vector<int> points;
  std::vector<double> buffer;
  int moved = 0;
  for (int i = 0; i < V.rows(); ++i) {
    if (hoods.boundary[i] || hoods.ring.degree(i) < 3) continue;
    hoods.two_ring(i, &points);
    points.push_back(i);
    const Eigen::RowVector3d x = V.row(i), n = N.row(i);
    if (n.squaredNorm() == 0) continue;
    if (use_median) {
      mesh.V.row(i) += median_height(V, points, x, n, &buffer) * n;
    } else {
      const Quadric q = fit_quadric(V, points, x, n, width);
      if (!q.valid || std::abs(q.height) > 2 * width) continue;
      mesh.V.row(i) += q.height * n;
    }
    ++moved;
  }
  return moved;
}

Eigen::VectorXd initial_reliability(const Mesh& mesh, const Neighbourhoods& hoods, double mean_edge) {
  Eigen::VectorXd r = Eigen::VectorXd::Ones(mesh.V.rows());
  for (int i = 0; i < mesh.V.rows(); ++i) {
    double longest = 0;
    for (const int* j = hoods.ring.begin(i); j != hoods.ring.end(i); ++j)
      longest = std::max(longest, (mesh.V.row(*j) - mesh.V.row(i)).norm());
    if (hoods.boundary[i] || longest == 0)
      r[i] = 0;
    else
      r[i] = std::min(1.0, 3 * mean_edge / longest);  // stretched triangles bridge what the scanner did not see
  }
  return r;
}

void check(const DenoiseOptions& o) {
  if (!(o.noise_gate >= 0) || !(o.spike_deviation > 0) || !(o.spike_isolation > 1) || !(o.gaussian_width > 0) ||
      o.passes < 0 || !(o.highest_flagged > 0))
    throw InvalidInput(
        "denoise: an option is out of range (noise_gate >= 0, spike_isolation > 1, gaussian_width > 0, passes >= 0)");
}

}  // namespace

double estimate_noise(const Vertices& V, const Faces& F) {
  Mesh mesh;
  mesh.V = V, mesh.F = F;
  return noise_of(V, vertex_normals(V, F), Neighbourhoods(mesh), mean_edge_length(V, F));
}

DenoiseResult denoise(const Mesh& scan, const DenoiseOptions& options) {
  check(options);
  DenoiseResult result;
  result.mesh = scan;
  const Neighbourhoods hoods(scan);
  const double mean_edge = mean_edge_length(scan.V, scan.F);
  DenoiseSummary& s = result.summary;
  s.noise = noise_of(scan.V, vertex_normals(scan.V, scan.F), hoods, mean_edge);
  result.reliability = initial_reliability(scan, hoods, mean_edge);
  if (options.method == DenoiseMethod::none) return result;
  const std::vector<int> spikes = mend_spikes(result.mesh, hoods, s.noise, mean_edge, options);
  if (static_cast<double>(spikes.size()) <= options.highest_flagged * static_cast<double>(scan.V.rows())) {
    s.spikes = static_cast<int>(spikes.size());
    for (const int i : spikes) result.reliability[i] = std::min(result.reliability[i], 0.3);
  } else {
    result.mesh.V = scan.V;  // so many cannot be spikes: the scan is coarse or strange, leave it alone
  }
  const bool use_median = options.method == DenoiseMethod::median;
  if (options.method == DenoiseMethod::automatic && s.noise <= options.noise_gate) return result;
  const Vertices before = result.mesh.V;
  for (int pass = 0; pass < options.passes; ++pass)
    s.filtered = filter_pass(result.mesh, hoods, 2 * options.gaussian_width * mean_edge, use_median);
  if (s.filtered > 0) s.rms_motion = std::sqrt((result.mesh.V - before).rowwise().squaredNorm().sum() / s.filtered);
  return result;
}

}  // namespace facewright
