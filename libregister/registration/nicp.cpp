// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/nicp.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"

namespace facewright {
namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;
constexpr double kRidge = 1e-9;  // hold of the identity

Eigen::RowVector4d homogeneous(const Vertices& V, Eigen::Index i) { return {V(i, 0), V(i, 1), V(i, 2), 1}; }

}  // namespace

struct NicpSystem::Parts {
  Vertices V;
  std::vector<Edge> edge_list;
  Eigen::VectorXd degrees;
  Eigen::Vector4d squared_gammas;  // of the rows of a transform
  Eigen::SimplicialLDLT<SparseMatrix, Eigen::Lower> solver;

  // Weight of every vertex's own 4 x 4 block, and the targets times their weights.
  struct Pulls {
    Eigen::VectorXd weights;
    Vertices weighted_targets;
  };
  Pulls pulls(const NicpData& data) const {
    Pulls p{data.weights, data.weights.asDiagonal() * data.targets};
    for (const LandmarkTarget& l : data.landmarks) {
      const double w = data.landmark_weight * data.landmark_weight / (l.stddev * l.stddev);
      p.weights[l.vertex] += w;
      p.weighted_targets.row(l.vertex) += w * l.position.transpose();
    }
    return p;
  }

  // Lower half of the normal matrix; its pattern depends on the edges alone.
  SparseMatrix normal_matrix(const Eigen::VectorXd& weights, double stiffness) const {
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(10 * static_cast<size_t>(V.rows()) + 4 * edge_list.size());
    const Eigen::Vector4d stiff = stiffness * stiffness * squared_gammas;
    for (int i = 0; i < V.rows(); ++i) {
      const Eigen::RowVector4d v = homogeneous(V, i);
      for (int r = 0; r < 4; ++r)
        for (int c = 0; c <= r; ++c)
          entries.emplace_back(4 * i + r, 4 * i + c,
                               weights[i] * v[r] * v[c] + (r == c ? degrees[i] * stiff[r] + kRidge : 0));
    }
    for (const Edge& e : edge_list)
      for (int r = 0; r < 4; ++r) entries.emplace_back(4 * e.v1 + r, 4 * e.v0 + r, -stiff[r]);
    SparseMatrix N(4 * V.rows(), 4 * V.rows());
    N.setFromTriplets(entries.begin(), entries.end());
    return N;
  }

  void check(const NicpData& data) const {
    if (data.targets.rows() != V.rows() || data.weights.size() != V.rows())
      throw InvalidInput("nicp: targets for " + std::to_string(data.targets.rows()) + " vertices and weights for " +
                         std::to_string(data.weights.size()) + ", the template has " + std::to_string(V.rows()));
    if (!data.targets.allFinite() || !data.weights.allFinite() || (data.weights.array() < 0).any())
      throw InvalidInput("nicp: targets must be finite and weights not negative");
    if (!(data.stiffness > 0) || !(data.landmark_weight >= 0))
      throw InvalidInput("nicp: stiffness > 0 and landmark_weight >= 0 are required");
    for (const LandmarkTarget& l : data.landmarks)
      if (l.vertex < 0 || l.vertex >= V.rows() || !(l.stddev > 0) || !l.position.allFinite())
        throw InvalidInput("nicp: a landmark of vertex " + std::to_string(l.vertex) + " and deviation " +
                           std::to_string(l.stddev) + " on a template of " + std::to_string(V.rows()) + " vertices");
  }
};

NicpSystem::NicpSystem(const Vertices& V, const Faces& F, double gamma) : parts_(std::make_unique<Parts>()) {
  if (F.rows() == 0) throw InvalidInput("nicp: the template has no triangles");
  if (F.minCoeff() < 0 || F.maxCoeff() >= V.rows())
    throw InvalidInput("nicp: triangles name vertices that are not there");
  if (!(gamma > 0) || !V.allFinite()) throw InvalidInput("nicp: finite positions and gamma > 0 are required");
  parts_->V = V;
  parts_->edge_list = edges(F);
  parts_->squared_gammas = {1, 1, 1, gamma * gamma};
  parts_->degrees = Eigen::VectorXd::Zero(V.rows());
  for (const Edge& e : parts_->edge_list) parts_->degrees[e.v0] += 1, parts_->degrees[e.v1] += 1;
  parts_->solver.analyzePattern(parts_->normal_matrix(Eigen::VectorXd::Ones(V.rows()), 1));
}
NicpSystem::~NicpSystem() = default;
NicpSystem::NicpSystem(NicpSystem&&) noexcept = default;
NicpSystem& NicpSystem::operator=(NicpSystem&&) noexcept = default;

VertexTransforms NicpSystem::identity() const {
  VertexTransforms X = VertexTransforms::Zero(4 * parts_->V.rows(), 3);
  for (Eigen::Index i = 0; i < parts_->V.rows(); ++i) X.middleRows<3>(4 * i).setIdentity();
  return X;
}

Vertices NicpSystem::apply(const VertexTransforms& X) const {
  Vertices out(parts_->V.rows(), 3);
  for (Eigen::Index i = 0; i < out.rows(); ++i) out.row(i) = homogeneous(parts_->V, i) * X.middleRows<4>(4 * i);
  return out;
}

VertexTransforms NicpSystem::solve(const NicpData& data) const {
  parts_->check(data);
  const Parts::Pulls pulls = parts_->pulls(data);
  VertexTransforms rhs = kRidge * identity();
  for (Eigen::Index i = 0; i < parts_->V.rows(); ++i)
    rhs.middleRows<4>(4 * i) += homogeneous(parts_->V, i).transpose() * pulls.weighted_targets.row(i);
  parts_->solver.factorize(parts_->normal_matrix(pulls.weights, data.stiffness));
  if (parts_->solver.info() != Eigen::Success)
    throw SolverError("nicp: the system of " + std::to_string(parts_->V.rows()) + " vertices could not be factorised");
  return parts_->solver.solve(rhs);
}

double NicpSystem::energy(const VertexTransforms& X, const NicpData& data) const {
  parts_->check(data);
  const Eigen::Vector4d stiff = data.stiffness * data.stiffness * parts_->squared_gammas;
  double E = kRidge * (X - identity()).squaredNorm();
  for (const Edge& e : parts_->edge_list)
    E += stiff.dot((X.middleRows<4>(4 * e.v0) - X.middleRows<4>(4 * e.v1)).rowwise().squaredNorm());
  const Vertices V = apply(X);
  E += data.weights.dot((V - data.targets).rowwise().squaredNorm());
  for (const LandmarkTarget& l : data.landmarks)
    E += data.landmark_weight * data.landmark_weight / (l.stddev * l.stddev) *
         (V.row(l.vertex).transpose() - l.position).squaredNorm();
  return E;
}

namespace {

void check(const NicpOptions& o) {
  if (o.stiffness.empty() || o.stiffness.size() != o.landmark_weights.size())
    throw InvalidInput("nicp: " + std::to_string(o.stiffness.size()) + " stiffnesses and " +
                       std::to_string(o.landmark_weights.size()) + " landmark weights; as many of both are required");
  if (o.highest_iterations < 1 || !(o.tolerance >= 0))
    throw InvalidInput("nicp: highest_iterations >= 1 and tolerance >= 0 are required");
}

MatchOptions match_options(const NicpOptions& o) {
  MatchOptions m;
  m.highest_distance = o.highest_distance;
  m.highest_angle = o.highest_angle;
  m.use_mirror = false;
  return m;
}

// Millimetres to a template about the origin with a unit diagonal.
struct UnitBox {
  Eigen::RowVector3d centre;
  double scale;
  explicit UnitBox(const Vertices& V) : centre(V.colwise().mean()) {
    scale = 1 / std::max((V.colwise().maxCoeff() - V.colwise().minCoeff()).norm(), 1e-12);
  }
  Vertices in(const Vertices& X) const { return scale * (X.rowwise() - centre); }
  Vertices out(const Vertices& X) const { return (X / scale).rowwise() + centre; }
};

}  // namespace

NicpResult nicp(const Vertices& V, const Faces& F, const MatchTarget& target,
                const std::vector<LandmarkTarget>& landmarks, const NicpOptions& options) {
  check(options);
  const UnitBox box(V);
  const NicpSystem system(box.in(V), F, options.gamma);
  NicpData data;
  data.landmarks = landmarks;
  for (LandmarkTarget& l : data.landmarks) l.position = box.scale * (l.position - box.centre.transpose());
  NicpResult result{V, {}, {}};
  result.summary.scale = box.scale;
  VertexTransforms X = system.identity();
  for (size_t stage = 0; stage < options.stiffness.size(); ++stage) {
    data.stiffness = options.stiffness[stage];
    data.landmark_weight = options.landmark_weights[stage];
    bool settled = false;
    for (int i = 0; i < options.highest_iterations && !settled; ++i) {
      result.matches = match_locally(result.V, F, {}, target, match_options(options));
      data.targets = box.in(result.matches.targets);
      data.weights.resize(V.rows());
      for (Eigen::Index v = 0; v < V.rows(); ++v)
        data.weights[v] = result.matches.origins[static_cast<size_t>(v)] == MatchOrigin::matched ? 1 : 0;
      const VertexTransforms next = system.solve(data);
      result.summary.steps.push_back(
          {data.stiffness, static_cast<int>(data.weights.sum()), system.energy(X, data), system.energy(next, data)});
      settled = (next - X).norm() / std::sqrt(static_cast<double>(X.size())) < options.tolerance;
      X = next;
      result.V = box.out(system.apply(X));
    }
    result.summary.converged = result.summary.converged && settled;
  }
  return result;
}

}  // namespace facewright
