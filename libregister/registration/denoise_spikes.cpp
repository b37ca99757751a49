// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/denoise_spikes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libmodel/core/median.h"
#include "libregister/registration/denoise_quadric.h"

namespace facewright {
namespace {

constexpr int kPasses = 4;
constexpr size_t kEnoughSkin = 12;
constexpr int kWidestSkin = 5;
// Skin at the border of a scan has few neighbours, and where it hides behind an ear they are all far below it.
constexpr double kBorderFactor = 3;

// Groups of vertices joined by edges along which the surface does not jump.
struct Groups {
  std::vector<int> label;                 // per vertex
  std::vector<std::vector<int>> members;  // of groups no larger than the largest cluster; empty for the others
};

Groups group(const Vertices& V, const Vertices& N, const ScanGraph& graph, double jump, int largest) {
  Groups g;
  g.label.assign(static_cast<size_t>(V.rows()), -1);
  std::vector<int> queue;
  for (int seed = 0; seed < V.rows(); ++seed) {
    if (g.label[static_cast<size_t>(seed)] >= 0) continue;
    const int label = static_cast<int>(g.members.size());
    queue.assign(1, seed);
    g.label[static_cast<size_t>(seed)] = label;
    for (size_t k = 0; k < queue.size(); ++k) {
      const int i = queue[k];
      for (const int* j = graph.ring.begin(i); j != graph.ring.end(i); ++j) {
        if (g.label[static_cast<size_t>(*j)] >= 0) continue;
        const Eigen::RowVector3d d = V.row(*j) - V.row(i);
        if (d.squaredNorm() > jump * jump && std::abs(d.dot((N.row(i) + N.row(*j)).normalized())) > jump) continue;
        g.label[static_cast<size_t>(*j)] = label;
        queue.push_back(*j);
      }
    }
    g.members.push_back(static_cast<int>(queue.size()) <= largest ? queue : std::vector<int>());
  }
  return g;
}

// Heights of the large groups' vertices within some rings of i above it, along its normal.
void heights_around(int i, int rings, const Vertices& V, const Vertices& N, const Groups& g, RingGatherer& gatherer,
                    std::vector<double>* heights) {
  heights->clear();
  for (const int j : gatherer.around(i, rings))
    if (g.members[static_cast<size_t>(g.label[static_cast<size_t>(j)])].empty())
      heights->push_back(N.row(i).dot(V.row(j) - V.row(i)));
}

// Rings about a member of a group that reach beyond it.
int rings_beyond(size_t members) { return members <= 2 ? 2 : members <= 7 ? 3 : 4; }

// The middle of a vertex's neighbours: where along the skin a spike belongs cannot be read off the spike itself, whose
// direction is the scanner's ray as often as the normal.
Eigen::RowVector3d middle_of_ring(const Vertices& V, const ScanGraph& graph, int i) {
  Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
  for (const int* j = graph.ring.begin(i); j != graph.ring.end(i); ++j) sum += V.row(*j);
  return sum / std::max(1, graph.ring.degree(i));
}

// Moves flagged vertices along their normals onto quadrics through the others around them.
void put_back(Vertices& V, const Vertices& N, const ScanGraph& graph, const std::vector<char>& flagged,
              double mean_edge, bool recentre) {
  RingGatherer gatherer(graph);
  std::vector<int> skin;
  std::vector<double> heights;
  for (int i = 0; i < V.rows(); ++i) {
    if (!flagged[static_cast<size_t>(i)]) continue;
    const std::vector<int>& points = gatherer.around(i, 2);
    size_t next = 0;
    skin.clear();
    for (int rings = 2;; ++rings, gatherer.grow()) {
      for (; next < points.size(); ++next)
        if (!flagged[static_cast<size_t>(points[next])]) skin.push_back(points[next]);
      if (skin.size() >= kEnoughSkin || rings == kWidestSkin) break;
    }
    if (skin.empty()) continue;
    if (recentre && !graph.border[static_cast<size_t>(i)]) V.row(i) = middle_of_ring(V, graph, i);
    LocalQuadric quadric(V.row(i), N.row(i), 2 * mean_edge);
    heights.clear();
    for (const int j : skin) {
      quadric.add(V.row(j), 1);
      heights.push_back(N.row(i).dot(V.row(j) - V.row(i)));
    }
    const double middle = median_of(heights);
    const LocalQuadric::Value fit = quadric.at_origin();
    const bool trusted = fit.valid && fit.variance < 1 && std::abs(fit.height - middle) < 2 * mean_edge;
    V.row(i) += (trusted ? fit.height : middle) * N.row(i);
  }
}

}  // namespace

Vertices sturdy_normals(const Vertices& V, const Faces& F, const ScanGraph& graph) {
  Vertices N = Vertices::Zero(V.rows(), 3);
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const Eigen::RowVector3d a = V.row(F(f, 0)), b = V.row(F(f, 1)), c = V.row(F(f, 2));
    const Eigen::RowVector3d n = (b - a).cross(c - a);
    const double length = n.norm();
    if (length == 0) continue;
    const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    for (int k = 0; k < 3; ++k) N.row(F(f, k)) += n / (length * longest);
  }
  for (int pass = 0; pass < 2; ++pass) {
    Vertices sum = N;
    for (int i = 0; i < V.rows(); ++i)
      for (const int* j = graph.ring.begin(i); j != graph.ring.end(i); ++j) sum.row(i) += N.row(*j);
    N.swap(sum);
  }
  for (Eigen::Index i = 0; i < N.rows(); ++i) {
    const double length = N.row(i).norm();
    if (length > 0) N.row(i) /= length;
  }
  return N;
}

std::vector<char> find_spikes(const Vertices& V, const Vertices& N, const ScanGraph& graph, double noise,
                              double mean_edge, const DenoiseOptions& options) {
  const double jump = std::max(options.spike_deviation * noise, options.spike_isolation * mean_edge);
  const Groups groups = group(V, N, graph, jump, options.largest_cluster);
  std::vector<char> spike(static_cast<size_t>(V.rows()), 0);
  RingGatherer gatherer(graph);
  std::vector<double> heights;
  for (const auto& members : groups.members)
    for (const int i : members) {
      if (graph.ring.degree(i) < 2) continue;
      heights_around(i, rings_beyond(members.size()), V, N, groups, gatherer, &heights);
      if (heights.size() < 4) continue;
      const double height = median_of(heights);
      for (double& h : heights) h = std::abs(h - height);
      const double roughness = 1.4826 * median_of(heights);
      const double bound = std::max(jump, options.spike_roughness * roughness);
      if (std::abs(height) > (graph.border[static_cast<size_t>(i)] ? kBorderFactor : 1) * bound)
        spike[static_cast<size_t>(i)] = 1;
    }
  return spike;
}

std::vector<char> mend_spikes(Vertices& V, const Faces& F, const ScanGraph& graph, double noise, double mean_edge,
                              const DenoiseOptions& options) {
  std::vector<char> mended(static_cast<size_t>(V.rows()), 0);
  bool any = false;
  for (int pass = 0; pass < kPasses; ++pass) {
    const Vertices N = sturdy_normals(V, F, graph);
    const std::vector<char> spike = find_spikes(V, N, graph, noise, mean_edge, options);
    bool found = false;
    for (size_t i = 0; i < spike.size(); ++i)
      if (spike[i]) mended[i] = 1, found = true;
    if (!found) break;
    put_back(V, N, graph, mended, mean_edge, false);
    any = true;
  }
  // Once more with normals that the spikes no longer tilt: in the middle of a cluster these make a millimetre or two.
  if (any) put_back(V, sturdy_normals(V, F, graph), graph, mended, mean_edge, true);
  return mended;
}

}  // namespace facewright
