// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/conform.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/geometry/folds.h"
#include "libmodel/geometry/laplacian.h"
#include "libmodel/geometry/normals.h"

namespace facewright {

using SparseMatrix = Eigen::SparseMatrix<double>;

struct ConformWorkspace::State {
  Faces F;
  std::vector<Edge> edge_list;  // of F
  SparseMatrix analysed;        // the pattern known to the solver
  Eigen::SimplicialLDLT<SparseMatrix> solver;
};

ConformWorkspace::ConformWorkspace() : state_(std::make_unique<State>()) {}
ConformWorkspace::~ConformWorkspace() = default;
ConformWorkspace::ConformWorkspace(ConformWorkspace&&) noexcept = default;
ConformWorkspace& ConformWorkspace::operator=(ConformWorkspace&&) noexcept = default;

namespace {

// Everything that stays fixed while stiffness is raised about folds.
struct Problem {
  const Vertices& V;
  const Faces& F;
  const std::vector<Edge>& edge_list;
  SparseMatrix L;        // cotangent stiffness of the rest shape
  Eigen::VectorXd data;  // diagonal: weight of each vertex's target
  Vertices rhs;          // sum of weight * (target - rest)
  SparseMatrix seam;     // quadratic form of the stitches
  double constant = 0;   // energy of the rest shape
};

Problem make_problem(const Vertices& V, const Faces& F, const Correspondence& matches,
                     const std::vector<LandmarkTarget>& landmarks, const std::vector<Edge>& edge_list,
                     const ConformOptions& o) {
  const Eigen::VectorXd A = vertex_areas(V, F);
  Problem p{V,
            F,
            edge_list,
            cotangent_stiffness(V, F, edge_list),
            matches.weights.cwiseProduct(A),
            {},
            SparseMatrix(V.rows(), V.rows()),
            0};
  const Vertices gap = matches.targets - V;
  p.rhs = p.data.asDiagonal() * gap;
  p.constant = p.data.dot(gap.rowwise().squaredNorm());
  const double mean_area = A.mean();
  for (const LandmarkTarget& k : landmarks) {
    const double w = o.landmark_weight * mean_area / (k.stddev * k.stddev);
    const Eigen::RowVector3d d = k.position.transpose() - V.row(k.vertex);
    p.data[k.vertex] += w;
    p.rhs.row(k.vertex) += w * d;
    p.constant += w * d.squaredNorm();
  }
  p.data.array() += o.rest_weight * mean_area;
  return p;
}

// Adds h |u_i - (1-t) u_a - t u_b - e|^2 per stitch, where e closes the gap of the rest shape to seam_gap.
void add_stitches(const std::vector<Stitch>& stitches, const ConformOptions& o, double mean_area, Problem* p) {
  std::vector<Eigen::Triplet<double>> entries;
  const double h = o.seam_weight * mean_area;
  for (const Stitch& s : stitches) {
    const int index[3] = {s.vertex, s.a, s.b};
    const double c[3] = {1, s.t - 1, -s.t};
    Eigen::RowVector3d gap = Eigen::RowVector3d::Zero();
    for (int i = 0; i < 3; ++i) gap += c[i] * p->V.row(index[i]);
    const double length = gap.norm();
    const Eigen::RowVector3d e =
        length > o.seam_gap ? Eigen::RowVector3d((o.seam_gap / length - 1) * gap) : Eigen::RowVector3d::Zero();
    for (int i = 0; i < 3; ++i) {
      p->rhs.row(index[i]) += h * c[i] * e;
      for (int j = 0; j < 3; ++j) entries.emplace_back(index[i], index[j], h * c[i] * c[j]);
    }
    p->constant += h * e.squaredNorm();
  }
  p->seam.setFromTriplets(entries.begin(), entries.end());
}

// l^2 times the stiffness, each edge scaled by the mean stiffness factor of its ends, plus the data diagonal.
SparseMatrix system_matrix(const Problem& p, double l2, const Eigen::VectorXd& factor) {
  SparseMatrix N = p.L;
  Eigen::VectorXd diagonal = p.data;
  for (int c = 0; c < N.outerSize(); ++c)
    for (SparseMatrix::InnerIterator it(N, c); it; ++it)
      if (it.row() != c) {
        it.valueRef() *= l2 * 0.5 * (factor[it.row()] + factor[c]);
        diagonal[c] -= it.value();
      }
  for (int c = 0; c < N.outerSize(); ++c) N.coeffRef(c, c) = diagonal[c];
  return p.seam.nonZeros() > 0 ? SparseMatrix(N + p.seam) : N;
}

// Vertices of both triangles at folded edges, and their neighbours.
void stiffen(const Problem& p, const std::vector<int>& folds, double by, Eigen::VectorXd* factor) {
  std::vector<bool> near(static_cast<size_t>(p.V.rows()), false);
  for (const int e : folds)
    for (const int f : {p.edge_list[e].f0, p.edge_list[e].f1})
      for (int k = 0; k < 3; ++k) near[p.F(f, k)] = true;
  std::vector<bool> wide = near;
  for (const Edge& e : p.edge_list) {
    if (near[e.v0]) wide[e.v1] = true;
    if (near[e.v1]) wide[e.v0] = true;
  }
  for (Eigen::Index i = 0; i < p.V.rows(); ++i)
    if (wide[i]) (*factor)[i] *= by;
}

bool same_pattern(const SparseMatrix& a, const SparseMatrix& b) {
  return a.cols() == b.cols() && a.nonZeros() == b.nonZeros() &&
         std::equal(a.outerIndexPtr(), a.outerIndexPtr() + a.cols() + 1, b.outerIndexPtr()) &&
         std::equal(a.innerIndexPtr(), a.innerIndexPtr() + a.nonZeros(), b.innerIndexPtr());
}

// Fails by throwing.
void factorise(SparseMatrix N, ConformWorkspace::State* w) {
  if (!same_pattern(N, w->analysed)) w->solver.analyzePattern(N);
  w->solver.factorize(N);
  w->analysed = std::move(N);
  if (w->solver.info() != Eigen::Success)
    throw SolverError("conform: the system of " + std::to_string(w->analysed.cols()) +
                      " vertices could not be factorised");
}

void check(const Vertices& V, const Correspondence& m, const ConformOptions& o) {
  if (m.targets.rows() != V.rows() || m.weights.size() != V.rows())
    throw InvalidInput("conform: matches for " + std::to_string(m.targets.rows()) + " vertices, the mesh has " +
                       std::to_string(V.rows()));
  if (!(o.smoothing_length > 0) || o.landmark_weight < 0 || o.seam_weight < 0 || o.seam_gap < 0 || o.rest_weight < 0 ||
      !(o.fold_stiffness > 1))
    throw InvalidInput("conform: smoothing_length > 0, weights >= 0 and fold_stiffness > 1 are required");
}

}  // namespace

ConformResult conform(const Vertices& V, const Faces& F, const Correspondence& matches,
                      const std::vector<LandmarkTarget>& landmarks, const ConformOptions& o,
                      const std::vector<Stitch>& stitches, ConformWorkspace* workspace) {
  check(V, matches, o);
  ConformWorkspace own;
  ConformWorkspace::State& w = workspace ? workspace->state() : own.state();
  if (w.F.rows() != F.rows() || w.F != F) w.F = F, w.edge_list = edges(F);
  Problem p = make_problem(V, F, matches, landmarks, w.edge_list, o);
  add_stitches(stitches, o, vertex_areas(V, F).mean(), &p);
  const double l2 = o.smoothing_length * o.smoothing_length;
  const size_t folds_of_rest = folded_edges(V, F, p.edge_list).size();
  Eigen::VectorXd factor = Eigen::VectorXd::Ones(V.rows());
  ConformResult result;
  ConformSummary& s = result.summary;
  for (int round = 0;; ++round) {
    factorise(system_matrix(p, l2, factor), &w);
    const Vertices u = w.solver.solve(p.rhs);
    result.V = V + u;
    // E(u) = u'Nu - 2u'r + c and Nu = r, hence E = c - u'r.
    s.energy_before = p.constant;
    s.energy_after = p.constant - u.cwiseProduct(p.rhs).sum();
    s.largest_motion = std::sqrt(u.rowwise().squaredNorm().maxCoeff());
    const std::vector<int> folds = folded_edges(result.V, F, p.edge_list);
    s.folds = static_cast<int>(folds.size());
    s.fold_rounds = round;
    if (folds.size() <= folds_of_rest || round >= o.fold_rounds) return result;
    stiffen(p, folds, o.fold_stiffness, &factor);
  }
}

int unfold(Vertices& V, const Faces& F, int rounds) {
  const std::vector<Edge> edge_list = edges(F);
  std::vector<int> folds = folded_edges(V, F, edge_list);
  if (folds.empty()) return 0;
  const Adjacency ring = vertex_neighbours(V.rows(), F);
  const std::vector<bool> boundary = boundary_vertices(V.rows(), F);
  for (int round = 0; round < rounds && !folds.empty(); ++round) {
    std::vector<int> touched;
    for (const int e : folds)
      for (const int f : {edge_list[e].f0, edge_list[e].f1})
        for (int k = 0; k < 3; ++k) touched.push_back(F(f, k));
    std::sort(touched.begin(), touched.end());
    touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    Vertices next = V;
    for (const int i : touched) {
      Eigen::RowVector3d mean = Eigen::RowVector3d::Zero();
      int count = 0;
      for (const int* j = ring.begin(i); j != ring.end(i); ++j)
        if (!boundary[i] || boundary[*j]) mean += V.row(*j), ++count;  // the border stays a curve
      if (count > 0) next.row(i) = 0.5 * V.row(i) + 0.5 * mean / count;
    }
    V = std::move(next);
    folds = folded_edges(V, F, edge_list);
  }
  return static_cast<int>(folds.size());
}

}  // namespace facewright
