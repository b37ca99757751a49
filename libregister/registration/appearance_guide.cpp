// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/appearance_guide.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "libmodel/core/errors.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

constexpr double kFarthest = 1.5;  // mm: a vertex farther from its scan has no colour there

using Gradients = std::vector<Eigen::Matrix3d>;  // per vertex: row c is the gradient of feature c, tangential

// Gradients of linear interpolants, averaged over the triangles about each vertex by area.
Gradients surface_gradients(const Vertices& V, const Faces& F, const AppearanceFeatures& f) {
  Gradients g(static_cast<size_t>(V.rows()), Eigen::Matrix3d::Zero());
  std::vector<double> area(static_cast<size_t>(V.rows()), 0.0);
  for (Eigen::Index t = 0; t < F.rows(); ++t) {
    const Eigen::Vector3d x[3] = {V.row(F(t, 0)), V.row(F(t, 1)), V.row(F(t, 2))};
    const Eigen::Vector3d normal = (x[1] - x[0]).cross(x[2] - x[0]);
    const double a2 = normal.norm();
    if (a2 < 1e-12) continue;
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();  // gradient times twice the area
    for (int k = 0; k < 3; ++k)
      sum += f.row(F(t, k)).transpose() * (normal / a2).cross(x[(k + 2) % 3] - x[(k + 1) % 3]).transpose();
    for (int k = 0; k < 3; ++k) g[static_cast<size_t>(F(t, k))] += sum, area[static_cast<size_t>(F(t, k))] += a2;
  }
  for (size_t i = 0; i < g.size(); ++i)
    if (area[i] > 0) g[i] /= area[i];
  return g;
}

// Information about the place of a vertex: inverse variances along the surface, 1/mm^2, of a perfect fit.
Eigen::Matrix3d information(const Eigen::Matrix3d& gradient, const Eigen::Vector3d& weights) {
  return gradient.transpose() * weights.asDiagonal() * gradient;
}

Eigen::Vector3d feature_weights(const FaceAppearance& a, int i, double area, const AppearanceGuideOptions& o) {
  Eigen::Vector3d w;
  for (int c = 0; c < kAppearanceFeatures; ++c) {
    const double d = a.deviation(i, c);
    w[c] = std::isfinite(d) ? area / o.independent_area / (d * d + o.feature_floor * o.feature_floor) : 0.0;
  }
  return w;
}

double gaussian(double distance, double width) { return std::exp(-0.5 * distance * distance / (width * width)); }

// Vertices within `radius` of each of `centres`, ascending.
std::vector<std::vector<int>> within(const Vertices& V, const std::vector<int>& centres, double radius) {
  std::vector<int> order(static_cast<size_t>(V.rows()));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return V(a, 1) < V(b, 1); });
  std::vector<std::vector<int>> found;
  for (const int k : centres) {
    const auto from =
        std::lower_bound(order.begin(), order.end(), V(k, 1) - radius, [&](int a, double y) { return V(a, 1) < y; });
    std::vector<int> near;
    for (auto i = from; i != order.end() && V(*i, 1) <= V(k, 1) + radius; ++i)
      if ((V.row(*i) - V.row(k)).norm() <= radius) near.push_back(*i);
    std::sort(near.begin(), near.end());
    found.push_back(std::move(near));
  }
  return found;
}

// Control points where colour has structure, the strongest first, none nearer than `spacing` to another.
std::vector<int> choose_controls(const Vertices& V, const Gradients& gradients, const FaceAppearance& appearance,
                                 const Eigen::VectorXd& areas, const AppearanceGuideOptions& o) {
  std::vector<int> all(static_cast<size_t>(V.rows()));
  std::iota(all.begin(), all.end(), 0);
  Eigen::VectorXd strength(V.rows());
  for (int i = 0; i < V.rows(); ++i)
    strength[i] = information(gradients[static_cast<size_t>(i)], feature_weights(appearance, i, areas[i], o)).trace() /
                  std::max(areas[i], 1e-9);
  std::sort(all.begin(), all.end(),
            [&](int a, int b) { return strength[a] != strength[b] ? strength[a] > strength[b] : a < b; });
  // What a window's worth of such surface tells, in the best case.
  const double window = 6.28 * o.window * o.window;
  std::vector<int> chosen;
  for (const int i : all) {
    if (strength[i] * window * o.highest_deviation * o.highest_deviation < 1 ||
        static_cast<int>(chosen.size()) >= o.highest_count)
      break;
    const bool free =
        std::none_of(chosen.begin(), chosen.end(), [&](int k) { return (V.row(k) - V.row(i)).norm() < o.spacing; });
    if (free) chosen.push_back(i);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace

AppearanceSample sample_appearance(const Vertices& V, const MatchTarget& target, const std::vector<bool>& needed,
                                   Vertices* nearest) {
  const Mesh& scan = target.mesh();
  if (!scan.has_colours()) throw InvalidInput("appearance: the scan has no colours");
  AppearanceSample s{Colours::Zero(V.rows(), 3), std::vector<bool>(static_cast<size_t>(V.rows()), false)};
  if (nearest) *nearest = V;
  for (Eigen::Index i = 0; i < V.rows(); ++i) {
    if (!needed.empty() && !needed[static_cast<size_t>(i)]) continue;
    const NearestPoint hit = target.index().nearest(V.row(i).transpose().eval());
    if (hit.distance > kFarthest) continue;
    bool whole = true;
    for (int k = 0; k < 3; ++k) {
      const int v = scan.F(hit.where.triangle, k);
      whole = whole && !target.boundary()[static_cast<size_t>(v)];
      s.colours.row(i) += hit.where.barycentric[k] * scan.colours.row(v);
    }
    s.seen[static_cast<size_t>(i)] = whole;
    if (nearest) nearest->row(i) = hit.position;
  }
  return s;
}

AppearanceGuide::AppearanceGuide(const MultiresTemplate& reference, const FaceAppearance& appearance,
                                 const AppearanceGuideOptions& options)
    : appearance_(appearance), options_(options) {
  if (appearance.empty()) return;
  space_ = std::make_shared<AppearanceSpace>(reference);
  const Mesh mesh = reference.level_mesh(space_->level());
  if (appearance.mean.rows() != mesh.V.rows() || appearance.deviation.rows() != mesh.V.rows())
    throw InvalidInput("appearance: " + std::to_string(appearance.mean.rows()) + " features for a level of " +
                       std::to_string(mesh.V.rows()) + " vertices");
  F_ = mesh.F;
  const Eigen::VectorXd areas = vertex_areas(mesh.V, mesh.F);
  controls_ = choose_controls(mesh.V, surface_gradients(mesh.V, mesh.F, appearance.mean), appearance, areas, options);
  const auto windows = within(mesh.V, controls_, 2.5 * options.window);
  // Every vertex is shared out among the windows that see it, so that nothing counts twice.
  Eigen::VectorXd total = Eigen::VectorXd::Zero(mesh.V.rows());
  const auto weight = [&](int k, int j) { return gaussian((mesh.V.row(k) - mesh.V.row(j)).norm(), options.window); };
  for (size_t k = 0; k < controls_.size(); ++k)
    for (const int j : windows[k]) total[j] += weight(controls_[k], j);
  needed_.assign(static_cast<size_t>(mesh.V.rows()), false);
  std::fill(needed_.begin(), needed_.begin() + space_->mean_count(), true);
  for (size_t k = 0; k < controls_.size(); ++k) {
    parts_.emplace_back();
    for (const int j : windows[k]) {
      const double w = weight(controls_[k], j);
      parts_.back().emplace_back(j, w / std::max(total[j], 1.0));
      needed_[static_cast<size_t>(j)] = true;
    }
  }
}

namespace {

// What a window tells of its control point: the sum of what its vertices tell.
struct WindowFit {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();  // information, 1/mm^2
  Eigen::Vector3d b = Eigen::Vector3d::Zero();  // A times the step
};

void add_vertex(const Eigen::Matrix3d& gradient, const Eigen::Vector3d& residual, const Eigen::Vector3d& deviation,
                double floor, Eigen::Vector3d weights, WindowFit* fit) {
  for (int c = 0; c < kAppearanceFeatures; ++c) {
    const double variance = deviation[c] * deviation[c] + floor * floor;
    const double t = 1 + residual[c] * residual[c] / (4 * variance);  // [geman1987]
    weights[c] /= t * t;
  }
  fit->A += information(gradient, weights);
  fit->b += gradient.transpose() * weights.asDiagonal() * residual;
}

// Along the principal directions in the tangent plane that are known well enough; and along the normal, where the
// surface itself says as much: about as far from the spline as faces bulge between landmarks.
void add_observations(const WindowFit& fit, int vertex, const Eigen::Vector3d& x, const Eigen::Vector3d& n,
                      const Eigen::Vector3d& on_scan, const AppearanceGuideOptions& o,
                      std::vector<GuideObservation>* observations) {
  Eigen::Matrix<double, 3, 2> T;
  T.col(0) = n.unitOrthogonal();
  T.col(1) = n.cross(T.col(0));
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(T.transpose() * fit.A * T);
  bool any = false;
  for (int e = 0; e < 2; ++e) {
    const double lambda = eigen.eigenvalues()[e];
    if (!(lambda * o.highest_deviation * o.highest_deviation > 1)) continue;
    const Eigen::Vector3d u = T * eigen.eigenvectors().col(e);
    const double step = std::clamp(u.dot(fit.b) / lambda, -o.farthest_step, o.farthest_step);
    observations->push_back(
        {vertex, u, u.dot(x) + step, std::sqrt(1 / lambda + o.least_deviation * o.least_deviation)});
    any = true;
  }
  if (any) observations->push_back({vertex, n, n.dot(on_scan), o.highest_deviation});
}

}  // namespace

std::vector<GuideObservation> AppearanceGuide::observe(const Vertices& V, const MatchTarget& target) const {
  std::vector<GuideObservation> observations;
  if (empty()) return observations;
  if (V.rows() != vertex_count()) throw InvalidInput("appearance: the guide's level has other vertices");
  Vertices nearest;
  const AppearanceSample sample = sample_appearance(V, target, needed_, &nearest);
  const AppearanceFeatures f = space_->features(sample);
  const Gradients gradients = surface_gradients(V, F_, appearance_.mean);
  const Eigen::VectorXd areas = vertex_areas(V, F_);
  const Vertices normals = vertex_normals(V, F_);
  for (size_t k = 0; k < controls_.size(); ++k) {
    const int v = controls_[k];
    if (!sample.seen[static_cast<size_t>(v)] || normals.row(v).squaredNorm() == 0) continue;
    WindowFit fit;
    for (const auto& [j, share] : parts_[k])
      if (sample.seen[static_cast<size_t>(j)])
        add_vertex(gradients[static_cast<size_t>(j)], (appearance_.mean.row(j) - f.row(j)).transpose(),
                   appearance_.deviation.row(j).transpose(), options_.feature_floor,
                   share * feature_weights(appearance_, j, areas[j], options_), &fit);
    add_observations(fit, v, V.row(v), normals.row(v), nearest.row(v), options_, &observations);
  }
  return observations;
}

}  // namespace facewright
