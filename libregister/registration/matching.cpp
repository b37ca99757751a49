// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/matching.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

Vertices smooth_normals(Vertices N, const Adjacency& ring, int times) {
  for (int t = 0; t < times; ++t) {
    Vertices next = N;
    for (int i = 0; i < ring.size(); ++i) {
      for (const int* j = ring.begin(i); j != ring.end(i); ++j) next.row(i) += N.row(*j);
      const double length = next.row(i).norm();
      if (length > 0) next.row(i) /= length;
    }
    N = std::move(next);
  }
  return N;
}

// Reference vertices within `rings` edges of i, by breadth-first search with a stamp per vertex.
class RingTest {
 public:
  explicit RingTest(const Adjacency& ring) : ring_(ring), stamp_(static_cast<size_t>(ring.size()), -1) {}
  bool within(int from, int to, int rings) {
    if (from == to) return true;
    ++now_;
    frontier_.assign(1, from);
    stamp_[from] = now_;
    for (int r = 0; r < rings; ++r) {
      next_.clear();
      for (const int v : frontier_)
        for (const int* j = ring_.begin(v); j != ring_.end(v); ++j) {
          if (*j == to) return true;
          if (stamp_[*j] != now_) stamp_[*j] = now_, next_.push_back(*j);
        }
      frontier_.swap(next_);
    }
    return false;
  }

 private:
  const Adjacency& ring_;
  std::vector<int> stamp_, frontier_, next_;
  int now_ = 0;
};

double interpolate(const Eigen::VectorXd& field, const Faces& F, const SurfacePoint& p) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) sum += p.barycentric[k] * field[F(p.triangle, k)];
  return sum;
}

bool touches_border(const MatchTarget& target, const NearestPoint& hit, double distance) {
  const Mesh& m = target.mesh();
  for (int k = 0; k < 3; ++k) {
    const int v = m.F(hit.where.triangle, k);
    if (target.boundary()[v] && (m.V.row(v).transpose() - hit.position).norm() < std::max(distance, target.mean_edge()))
      return true;
  }
  return false;
}

Eigen::Vector3d normal_at(const Vertices& N, const Faces& F, const SurfacePoint& p) {
  Eigen::Vector3d n = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) n += p.barycentric[k] * N.row(F(p.triangle, k)).transpose();
  return n.normalized();
}

NearestPoint snap_to_vertex(const NearestPoint& hit, const Mesh& scan, const Eigen::Vector3d& query) {
  NearestPoint snapped = hit;
  int k;
  hit.where.barycentric.maxCoeff(&k);
  snapped.where.barycentric = Eigen::Vector3d::Unit(k);
  snapped.position = scan.V.row(scan.F(hit.where.triangle, k));
  snapped.distance = (snapped.position - query).norm();
  return snapped;
}

// The vertex's own tests, in the order in which their failure is reported.
MatchStatus judge(const NearestPoint& hit, const Eigen::Vector3d& normal, const Vertices& scan_normals,
                  const MatchTarget& target, const MatchOptions& o, double* agreement) {
  if (hit.distance > o.highest_distance) return MatchStatus::too_far;
  *agreement = normal.dot(normal_at(scan_normals, target.mesh().F, hit.where));
  if (*agreement < std::cos(o.highest_angle)) return MatchStatus::normal_disagrees;
  if (touches_border(target, hit, o.border_distance)) return MatchStatus::on_border;
  if (interpolate(target.reliability(), target.mesh().F, hit.where) < 0.05) return MatchStatus::unreliable;
  return MatchStatus::accepted;
}

void match_own(const Vertices& V, const Faces& F, const MatchTarget& target, const MatchOptions& o, Correspondence& c) {
  const Vertices N = vertex_normals(V, F);
  const Vertices& scan_normals = target.normals(mean_edge_length(V, F));
  const Adjacency ring = vertex_neighbours(V.rows(), F);
  Vertices hits(V.rows(), 3);
  std::vector<int> triangles(static_cast<size_t>(V.rows()), -1);
  for (int i = 0; i < V.rows(); ++i) {
    const Eigen::Vector3d x = V.row(i);
    const int seed = ring.degree(i) > 0 && *ring.begin(i) < i ? triangles[*ring.begin(i)] : -1;  // a neighbour's match
    NearestPoint hit = target.index().nearest(x, seed);
    triangles[i] = hit.where.triangle;
    if (o.to_vertices) hit = snap_to_vertex(hit, target.mesh(), x);
    double agreement = 0;
    c.status[i] = judge(hit, N.row(i), scan_normals, target, o, &agreement);
    c.distances[i] = hit.distance;
    hits.row(i) = hit.position;
    if (c.status[i] != MatchStatus::accepted) continue;
    const double d = hit.distance / o.welsch_width;
    c.weights[i] = interpolate(target.reliability(), target.mesh().F, hit.where) * agreement * std::exp(-0.5 * d * d);
  }
  // Back-check: a match that belongs to a distant part of the reference has jumped (lip to lip, through a nostril).
  std::vector<int> accepted;
  for (int i = 0; i < V.rows(); ++i)
    if (c.status[i] == MatchStatus::accepted) accepted.push_back(i);
  if (accepted.empty()) return;
  const std::vector<int> nearest = PointIndex(V).nearest(Vertices(hits(accepted, Eigen::all)));
  RingTest test(ring);
  for (size_t k = 0; k < accepted.size(); ++k) {
    const int i = accepted[k];
    if (!test.within(i, nearest[k], static_cast<int>(o.mutual_rings))) {
      c.status[i] = MatchStatus::not_mutual;
      c.weights[i] = 0;
      continue;
    }
    c.targets.row(i) = hits.row(i);
    c.origins[i] = MatchOrigin::matched;
  }
}

void match_mirrored(const Vertices& V, const std::vector<int>& mirror, const MatchOptions& o, Correspondence& c) {
  const SymmetryPlane plane = symmetry_plane(V, mirror);
  const Eigen::Matrix3d reflect = Eigen::Matrix3d::Identity() - 2 * plane.normal * plane.normal.transpose();
  for (int i = 0; i < V.rows(); ++i) {
    const int j = mirror[i];
    if (c.origins[i] != MatchOrigin::free || j == i || c.origins[j] != MatchOrigin::matched) continue;
    if (c.status[i] == MatchStatus::normal_disagrees || c.status[i] == MatchStatus::not_mutual)
      continue;  // data lies there, only ambiguous
    const Eigen::Vector3d d = reflect * (c.targets.row(j) - V.row(j)).transpose();
    if (d.norm() > o.highest_distance) continue;
    c.targets.row(i) = V.row(i) + d.transpose();
    c.weights[i] = o.mirrored_weight * c.weights[j];
    c.origins[i] = MatchOrigin::mirrored;
  }
}

void match_interpolated(const Vertices& V, const Faces& F, const MatchOptions& o, Correspondence& c) {
  std::vector<bool> known(static_cast<size_t>(V.rows()));
  double weight = 0;
  int count = 0;
  for (int i = 0; i < V.rows(); ++i) {
    known[i] = c.origins[i] != MatchOrigin::free;
    if (known[i]) weight += c.weights[i], ++count;
  }
  if (count == 0 || count == V.rows()) return;
  const Vertices filled = fill_harmonic(V, F, c.targets - V, known);
  const Components components = connected_components(V.rows(), F);
  std::vector<bool> anchored(static_cast<size_t>(components.count), false);
  for (int i = 0; i < V.rows(); ++i)
    if (known[i]) anchored[components.vertex_label[i]] = true;
  for (int i = 0; i < V.rows(); ++i) {
    if (known[i] || !anchored[components.vertex_label[i]]) continue;
    c.targets.row(i) = V.row(i) + filled.row(i);
    c.weights[i] = o.interpolated_weight * weight / count;
    c.origins[i] = MatchOrigin::interpolated;
  }
}

void check(const MatchOptions& o, Eigen::Index vertices, const std::vector<int>& mirror) {
  if (!(o.highest_distance > 0) || !(o.welsch_width > 0) || !(o.highest_angle > 0) || o.mutual_rings < 0)
    throw InvalidInput("matching: distances, widths and angles must be positive");
  if (!mirror.empty() && static_cast<Eigen::Index>(mirror.size()) < vertices)
    throw InvalidInput("matching: the symmetry table has " + std::to_string(mirror.size()) + " entries for " +
                       std::to_string(vertices) + " vertices");
}

}  // namespace

int Correspondence::count(MatchOrigin origin) const {
  return static_cast<int>(std::count(origins.begin(), origins.end(), origin));
}

MatchTarget::MatchTarget(Mesh scan, Eigen::VectorXd reliability)
    : mesh_(std::move(scan)), index_(mesh_.V, mesh_.F), reliability_(std::move(reliability)) {
  if (reliability_.size() != mesh_.V.rows()) throw InvalidInput("matching: one reliability per scan vertex is needed");
  boundary_ = boundary_vertices(mesh_.V.rows(), mesh_.F);
  mean_edge_ = mean_edge_length(mesh_.V, mesh_.F);
  const Adjacency ring = vertex_neighbours(mesh_.V.rows(), mesh_.F);
  normals_.push_back(vertex_normals(mesh_.V, mesh_.F));
  for (const int times : {1, 3, 12}) normals_.push_back(smooth_normals(normals_.back(), ring, times));
}

const Vertices& MatchTarget::normals(double length) const {
  // n averagings spread over about sqrt(n) edges.
  const double edges = length / std::max(mean_edge_, 1e-9);
  const size_t scale = edges < 1.2 ? 0 : edges < 2 ? 1 : edges < 4 ? 2 : 3;
  return normals_[scale];
}

Correspondence match_locally(const Vertices& V, const Faces& F, const std::vector<int>& mirror,
                             const MatchTarget& target, const MatchOptions& options) {
  check(options, V.rows(), mirror);
  const auto n = static_cast<size_t>(V.rows());
  Correspondence c;
  c.targets = V;
  c.weights = Eigen::VectorXd::Zero(V.rows());
  c.distances = Eigen::VectorXd::Zero(V.rows());
  c.origins.assign(n, MatchOrigin::free);
  c.status.assign(n, MatchStatus::too_far);
  match_own(V, F, target, options, c);
  if (options.use_mirror && !mirror.empty()) match_mirrored(V, mirror, options, c);
  match_interpolated(V, F, options, c);
  return c;
}

}  // namespace facewright
