// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/denoise.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/core/median.h"
#include "libmodel/geometry/normals.h"
#include "libregister/registration/denoise_filters.h"
#include "libregister/registration/denoise_graph.h"
#include "libregister/registration/denoise_quadric.h"
#include "libregister/registration/denoise_spikes.h"

namespace facewright {
namespace {

constexpr double kStretched = 3, kCurtain = 5;  // mean edge lengths

// Mean normal of the points around, the vertex itself left out (a spike tilts its own normal).
Eigen::Vector3d mean_normal(const Vertices& N, const std::vector<int>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const int j : points) sum += N.row(j);
  const double length = sum.norm();
  return length > 1e-9 ? Eigen::Vector3d(sum / length) : Eigen::Vector3d::Zero();
}

double noise_of(const Vertices& V, const Vertices& N, const ScanGraph& graph, double mean_edge) {
  constexpr int kSamples = 4000;
  const int n = static_cast<int>(V.rows()), step = std::max(1, n / kSamples);
  std::vector<double> r;
  RingGatherer gatherer(graph);
  for (int i = 0; i < n; i += step) {
    if (graph.border[static_cast<size_t>(i)]) continue;
    const std::vector<int>& points = gatherer.around(i, 2);
    const Eigen::Vector3d normal = mean_normal(N, points);
    if (normal.squaredNorm() == 0) continue;
    const double width = 2 * mean_edge;
    LocalQuadric quadric(V.row(i), normal, width);
    for (const int j : points)
      quadric.add(V.row(j), std::exp(-0.5 * (V.row(j) - V.row(i)).squaredNorm() / (width * width)));
    const LocalQuadric::Value q = quadric.at_origin();
    // The quadric's own variance is about (sum of weights)^-1 of the noise; `variance` is that factor.
    if (q.valid) r.push_back(std::abs(q.height) / std::sqrt(1 + q.variance));
  }
  return r.size() < 50 ? 0 : 1.4826 * median_of(r);
}

// Vertices within some edges of the border.
std::vector<char> near_border(const ScanGraph& graph, int rings) {
  std::vector<char> near = graph.border;
  for (int r = 0; r < rings; ++r) {
    std::vector<char> next = near;
    for (int i = 0; i < graph.ring.size(); ++i)
      if (near[static_cast<size_t>(i)])
        for (const int* j = graph.ring.begin(i); j != graph.ring.end(i); ++j) next[static_cast<size_t>(*j)] = 1;
    near.swap(next);
  }
  return near;
}

Eigen::VectorXd initial_reliability(const Vertices& V, const ScanGraph& graph, double mean_edge) {
  const std::vector<char> near = near_border(graph, 2);
  Eigen::VectorXd r = Eigen::VectorXd::Ones(V.rows());
  for (int i = 0; i < V.rows(); ++i) {
    double longest = 0;
    for (const int* j = graph.ring.begin(i); j != graph.ring.end(i); ++j)
      longest = std::max(longest, (V.row(*j) - V.row(i)).norm());
    const bool curtain = near[static_cast<size_t>(i)] && longest > kCurtain * mean_edge;
    if (graph.border[static_cast<size_t>(i)] || curtain || longest == 0)
      r[i] = 0;
    else
      r[i] = std::min(1.0, kStretched * mean_edge / longest);  // long triangles bridge what the scanner did not see
  }
  return r;
}

void check(const DenoiseOptions& o) {
  if (!(o.noise_gate >= 0) || !(o.spike_deviation > 0) || !(o.spike_isolation > 0) || !(o.spike_roughness >= 0) ||
      o.largest_cluster < 1 || !(o.gaussian_width > 0) || o.widest < 2 || !(o.widest_mm > 0) || !(o.agreement > 0) ||
      o.passes < 0 || !(o.highest_flagged > 0) || !(o.misfit > 0) || !(o.bilateral_sigma > 0) || o.normal_passes < 0 ||
      o.vertex_passes < 0)
    throw InvalidInput(
        "denoise: an option is out of range (noise_gate, spike_roughness, passes >= 0; largest_cluster >= 1; widest >= "
        "2; all other numbers > 0)");
}

Vertices filtered(const Vertices& V, const Faces& F, const ScanGraph& graph, double noise, double mean_edge,
                  const DenoiseOptions& options) {
  switch (options.method) {
    case DenoiseMethod::median:
      return median_heights(V, F, graph);
    case DenoiseMethod::bilateral:
      return bilateral_normals(V, F, graph, noise, mean_edge, options);
    default:
      return project_on_quadrics(V, F, graph, noise, mean_edge, options);
  }
}

}  // namespace

double estimate_noise(const Vertices& V, const Faces& F) {
  return noise_of(V, vertex_normals(V, F), scan_graph(V.rows(), F), mean_edge_length(V, F));
}

DenoiseResult denoise(const Mesh& scan, const DenoiseOptions& options) {
  check(options);
  DenoiseResult result;
  result.mesh = scan;
  Vertices& V = result.mesh.V;
  const ScanGraph graph = scan_graph(scan.V.rows(), scan.F);
  const double mean_edge = mean_edge_length(scan.V, scan.F);
  DenoiseSummary& s = result.summary;
  s.noise = noise_of(scan.V, vertex_normals(scan.V, scan.F), graph, mean_edge);
  result.reliability = initial_reliability(scan.V, graph, mean_edge);
  if (options.method == DenoiseMethod::none) return result;
  const std::vector<char> spikes = mend_spikes(V, scan.F, graph, s.noise, mean_edge, options);
  for (int i = 0; i < V.rows(); ++i)
    if (spikes[static_cast<size_t>(i)]) result.spikes.push_back(i);
  if (static_cast<double>(result.spikes.size()) > options.highest_flagged * static_cast<double>(V.rows())) {
    V = scan.V;  // so many cannot be spikes: the scan is coarse or strange, leave it alone
    result.spikes.clear();
  }
  s.spikes = static_cast<int>(result.spikes.size());
  for (const int i : result.spikes) result.reliability[i] = std::min(result.reliability[i], 0.3);
  if (options.method == DenoiseMethod::automatic && s.noise <= options.noise_gate) return result;
  const Vertices before = V;
  for (int pass = 0; pass < options.passes; ++pass) V = filtered(V, scan.F, graph, s.noise, mean_edge, options);
  if (options.passes > 0) V = smooth_borders(V, scan.F, graph, s.noise);
  s.filtered = static_cast<int>((V.array() != before.array()).rowwise().any().count());
  if (s.filtered > 0) s.rms_motion = std::sqrt((V - before).rowwise().squaredNorm().sum() / s.filtered);
  return result;
}

}  // namespace facewright
