// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/surface/compare.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/surface/nearest.h"

namespace facewright {

namespace {

constexpr int kFewestPoints = 12;     // seven unknowns, and some to spare
constexpr double kStepEnough = 1e-3;  // mm: far below any scanner's noise
constexpr double kOnEdge = 1e-9;      // barycentric coordinates this small lie on the opposite edge

// The target with what the comparison asks of it.
struct Target {
  const Mesh& mesh;
  SurfaceIndex index;
  Faces neighbours;
  std::vector<bool> on_border;

  explicit Target(const Mesh& m)
      : mesh(m), index(m.V, m.F), neighbours(face_neighbours(m.F)), on_border(boundary_vertices(m.V.rows(), m.F)) {}

  // The surface ends here: the place lies on a border edge or border vertex.
  bool is_border(const SurfacePoint& place) const {
    for (int k = 0; k < 3; ++k) {
      const bool on_opposite_edge = place.barycentric[k] < kOnEdge;
      if (on_opposite_edge && neighbours(place.triangle, (k + 1) % 3) < 0) return true;
      if (place.barycentric[k] > 1 - kOnEdge && on_border[static_cast<size_t>(mesh.F(place.triangle, k))]) return true;
    }
    return false;
  }

  Eigen::Vector3d normal(int f) const {
    const Eigen::Vector3d a = mesh.V.row(mesh.F(f, 0)), b = mesh.V.row(mesh.F(f, 1)), c = mesh.V.row(mesh.F(f, 2));
    return (b - a).cross(c - a).normalized();
  }
};

double quantile(std::vector<double> values, double share) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

Vertices strided(const Vertices& V, int max_points) {
  const Eigen::Index stride = std::max<Eigen::Index>(1, (V.rows() + max_points - 1) / max_points);
  Vertices sample((V.rows() + stride - 1) / stride, 3);
  for (Eigen::Index i = 0; i < sample.rows(); ++i) sample.row(i) = V.row(i * stride);
  return sample;
}

double tukey_weight(double distance, double scale) {
  const double u = distance / scale;
  return u < 1 ? (1 - u * u) * (1 - u * u) : 0;
}

// One Gauss-Newton step of sum w (n . (p + omega x p + ds p + t - q))^2, p about its centre.
Similarity point_to_plane_step(const Vertices& P, const std::vector<NearestPoint>& places, const Target& target,
                               SurfaceAlignment alignment) {
  std::vector<double> distances;
  for (const NearestPoint& place : places)
    if (!target.is_border(place.where)) distances.push_back(place.distance);
  if (distances.size() < kFewestPoints)
    throw InvalidInput("compare: only " + std::to_string(distances.size()) + " of " + std::to_string(P.rows()) +
                       " vertices lie over the other surface; give landmarks of both so that they start aligned");
  const double scale = std::max(1e-6, 4.685 * 1.4826 * quantile(distances, 0.5));  // Tukey at 95 % efficiency
  const Eigen::RowVector3d centre = P.colwise().mean();

  using Vector7 = Eigen::Matrix<double, 7, 1>;
  Eigen::Matrix<double, 7, 7> H = Eigen::Matrix<double, 7, 7>::Zero();
  Vector7 g = Vector7::Zero();
  for (Eigen::Index i = 0; i < P.rows(); ++i) {
    const NearestPoint& place = places[static_cast<size_t>(i)];
    if (target.is_border(place.where)) continue;
    const double w = tukey_weight(place.distance, scale);
    const Eigen::Vector3d n = target.normal(place.where.triangle), p = (P.row(i) - centre).transpose();
    Vector7 J;
    J << p.cross(n), n, n.dot(p);
    H += w * J * J.transpose();
    g += w * J * n.dot(place.position - P.row(i).transpose());
  }
  const int unknowns = alignment == SurfaceAlignment::similarity ? 7 : 6;
  // Directions the surfaces leave undetermined (spinning a sphere) stay where they are.
  H.diagonal().array() += 1e-9 * H.trace();
  Vector7 step = Vector7::Zero();
  step.head(unknowns) = H.topLeftCorner(unknowns, unknowns).ldlt().solve(g.head(unknowns));

  Similarity update;
  const Eigen::Vector3d omega = step.head<3>();
  if (omega.norm() > 0) update.R = Eigen::AngleAxisd(omega.norm(), omega.normalized()).toRotationMatrix();
  update.s = std::exp(step[6]);
  update.t = centre.transpose() + step.segment<3>(3) - update.s * (update.R * centre.transpose());
  return update;
}

void align(const Mesh& source, const Target& target, const CompareOptions& options, CompareResult& result) {
  const Vertices sample = strided(source.V, options.max_points);
  Similarity& T = result.target_from_source;
  Vertices P = T.apply(sample);
  for (int i = 0; i < options.max_iterations && !result.summary.converged; ++i) {
    T = point_to_plane_step(P, target.index.nearest(P, options.threads), target, options.alignment) * T;
    const Vertices moved = T.apply(sample);
    result.summary.converged = (moved - P).rowwise().norm().maxCoeff() < kStepEnough;
    result.summary.iterations = i + 1;
    P = moved;
  }
}

void measure(const Mesh& source, const Target& target, int threads, CompareResult& result) {
  const auto places = target.index.nearest(result.target_from_source.apply(source.V), threads);
  result.distances = Eigen::VectorXd::Constant(source.V.rows(), -1);
  std::vector<double> compared;
  for (size_t i = 0; i < places.size(); ++i) {
    if (target.is_border(places[i].where)) continue;
    result.distances[static_cast<Eigen::Index>(i)] = places[i].distance;
    compared.push_back(places[i].distance);
  }
  if (compared.empty()) throw InvalidInput("compare: no vertex lies over the other surface; are they aligned?");
  CompareSummary& summary = result.summary;
  const Eigen::Map<const Eigen::ArrayXd> d(compared.data(), static_cast<Eigen::Index>(compared.size()));
  summary.compared = d.size();
  summary.mean = d.mean();
  summary.rms = std::sqrt(d.square().mean());
  summary.median = quantile(compared, 0.5);
  summary.p95 = quantile(compared, 0.95);
  summary.max = d.maxCoeff();
}

}  // namespace

CompareResult compare_surfaces(const Mesh& source, const Mesh& target, const CompareOptions& options) {
  validate(source);
  validate(target);
  if (source.V.rows() == 0) throw InvalidInput("compare: the source mesh has no vertices");
  if (options.max_iterations < 1 || options.max_points < kFewestPoints)
    throw InvalidInput("compare: expected max_iterations >= 1 and max_points >= " + std::to_string(kFewestPoints));
  CompareResult result;
  result.target_from_source = options.start;
  const Target indexed(target);
  if (options.alignment != SurfaceAlignment::none) align(source, indexed, options, result);
  measure(source, indexed, options.threads, result);
  return result;
}

}  // namespace facewright
