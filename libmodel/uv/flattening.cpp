// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/uv/flattening.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "libmodel/uv/symmetric_dirichlet.h"
#include "libmodel/uv/unfolding.h"

namespace facewright {
namespace {

constexpr double kLeastGain = 1e-9;       // of the energy, per step
constexpr double kHoleWeight = 1e-2;      // of a triangle that only keeps a hole open
constexpr double kLeastArea = 1e-4;       // of the mean triangle's
constexpr double kSufficientGain = 1e-4;  // of what the slope promises
constexpr double kShareOfWayToFlip = 0.9;
constexpr double kLeastStep = 1e-12;
constexpr size_t kHistory = 10;

using Corners = Eigen::Matrix<double, 3, 2>;
using Field = Eigen::VectorXd;  // (2N), u and v of a vertex side by side

Eigen::Map<const TexCoords> as_uv(const Field& x) { return {x.data(), x.size() / 2, 2}; }

// Triangles of the surface keep their shape, those of holes the one they start with.
std::vector<RestTriangle> rest_triangles(const FlatteningProblem& p, const TexCoords& start) {
  std::vector<RestTriangle> rest;
  double total = 0;
  for (Eigen::Index f = 0; f < p.F.rows(); ++f) {
    Eigen::Vector3d e[2];
    for (int k = 0; k < 2; ++k) {
      e[k] = p.V.row(p.F(f, k + 1)) - p.V.row(p.F(f, 0));
      if (f >= p.face_count) e[k] << (start.row(p.F(f, k + 1)) - start.row(p.F(f, 0))).transpose(), 0;
    }
    if (f < p.face_count) total += 0.5 * e[0].cross(e[1]).norm();
    rest.push_back(rest_triangle(e[0], e[1], 0));
  }
  const double least = kLeastArea * total / static_cast<double>(p.face_count);
  for (Eigen::Index f = 0; f < p.F.rows(); ++f) {
    RestTriangle& t = rest[static_cast<size_t>(f)];
    if (!(t.area() >= least)) t = rest_triangle(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), least);
    t.weight = (f < p.face_count ? 1 : kHoleWeight) * t.area() / total;
  }
  return rest;
}

class MapEnergy {
 public:
  MapEnergy(const FlatteningProblem& problem, const TexCoords& start, double stretch_weight)
      : p_(problem), rest_(rest_triangles(problem, start)), lambda_(stretch_weight) {
    for (size_t i = 0; i < p_.distances.sources.size(); ++i)
      if (p_.distances.sources[i] < p_.vertex_count) rows_.push_back(static_cast<Eigen::Index>(i));
    for (Eigen::Index i : rows_) total_ += p_.distances.D.row(i).head(p_.vertex_count).squaredNorm();
    // rows of one source are read again and again: make them contiguous
    D_.resize(p_.vertex_count, static_cast<Eigen::Index>(rows_.size()));
    for (size_t i = 0; i < rows_.size(); ++i)
      D_.col(static_cast<Eigen::Index>(i)) = p_.distances.D.row(rows_[i]).head(p_.vertex_count).transpose();
  }

  double value(const Field& x) const {
    double stretch = 0;
    for (Eigen::Index f = 0; f < p_.F.rows(); ++f)
      stretch += rest(f).weight * symmetric_dirichlet(rest(f), corners(x, f));
    return std::isfinite(stretch) ? lambda_ * stretch + stress(x, nullptr) : std::numeric_limits<double>::infinity();
  }

  struct Terms {
    Field gradient;
    Eigen::SparseMatrix<double> hessian;  // positive definite
  };
  Terms terms(const Field& x) const {
    Terms result;
    result.gradient = Field::Zero(x.size());
    stress(x, &result.gradient);
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(static_cast<size_t>(36 * p_.F.rows() + x.size()));
    add_majoriser(x.size(), &entries);
    for (Eigen::Index f = 0; f < p_.F.rows(); ++f) {
      const DirichletTerms t = symmetric_dirichlet_terms(rest(f), corners(x, f));
      const double w = lambda_ * rest(f).weight;
      const auto at = [&](int i) { return 2 * p_.F(f, i / 2) + i % 2; };
      for (int i = 0; i < 6; ++i) {
        result.gradient[at(i)] += w * t.gradient[i];
        for (int j = 0; j < 6; ++j) entries.emplace_back(at(i), at(j), w * t.hessian(i, j));
      }
    }
    result.hessian.resize(x.size(), x.size());
    result.hessian.setFromTriplets(entries.begin(), entries.end());
    return result;
  }

 private:
  const RestTriangle& rest(Eigen::Index f) const { return rest_[static_cast<size_t>(f)]; }
  Corners corners(const Field& x, Eigen::Index f) const {
    Corners c;
    for (int k = 0; k < 3; ++k) c.row(k) = x.segment<2>(2 * p_.F(f, k)).transpose();
    return c;
  }
  int source(size_t i) const { return p_.distances.sources[static_cast<size_t>(rows_[i])]; }

  double stress(const Field& x, Field* gradient) const {
    const Eigen::Index n = p_.vertex_count;
    const Eigen::ArrayXd u = as_uv(x).col(0).head(n), v = as_uv(x).col(1).head(n);
    Eigen::ArrayXd du(n), dv(n), length(n), sum_u = Eigen::ArrayXd::Zero(n), sum_v = sum_u;
    double error = 0;
    for (size_t i = 0; i < rows_.size(); ++i) {
      const int s = source(i);
      du = u - u[s], dv = v - v[s];
      length = (du.square() + dv.square()).sqrt();
      const auto off = length - D_.col(static_cast<Eigen::Index>(i)).array();
      error += off.square().sum();
      if (!gradient) continue;
      length = 2 / total_ * off / length.max(1e-12);
      du *= length, dv *= length;
      sum_u += du, sum_v += dv;
      sum_u[s] -= du.sum(), sum_v[s] -= dv.sum();
    }
    if (gradient)
      for (Eigen::Index k = 0; k < n; ++k) (*gradient)[2 * k] += sum_u[k], (*gradient)[2 * k + 1] += sum_v[k];
    return error / total_;
  }

  void add_majoriser(Eigen::Index size, std::vector<Eigen::Triplet<double>>* entries) const {
    Eigen::VectorXd links = Eigen::VectorXd::Constant(size / 2, 1e-6);  // a hole's centre has none
    links.head(p_.vertex_count).setConstant(static_cast<double>(rows_.size()));
    for (size_t i = 0; i < rows_.size(); ++i) links[source(i)] += static_cast<double>(p_.vertex_count);
    for (Eigen::Index k = 0; k < size; ++k) entries->emplace_back(k, k, 2 / total_ * links[k / 2]);
  }

  const FlatteningProblem& p_;
  std::vector<RestTriangle> rest_;
  double lambda_;
  std::vector<Eigen::Index> rows_;
  Eigen::MatrixXd D_;  // (N x sources)
  double total_ = 0;
};

// The smallest positive t at which a triangle of x + t d has no area.
double way_to_flip(const Faces& F, const Field& x, const Field& d) {
  double way = std::numeric_limits<double>::infinity();
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); };
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const auto edge = [&](const Field& y, int k) -> Eigen::Vector2d {
      return y.segment<2>(2 * F(f, k)) - y.segment<2>(2 * F(f, 0));
    };
    const Eigen::Vector2d a = edge(x, 1), b = edge(x, 2), p = edge(d, 1), q = edge(d, 2);
    const double c0 = cross(a, b), c1 = cross(a, q) + cross(p, b), c2 = cross(p, q);
    const double disc = c1 * c1 - 4 * c2 * c0;
    if (disc < 0) continue;
    const double h = -0.5 * (c1 + std::copysign(std::sqrt(disc), c1));
    for (double t : {c2 != 0 ? h / c2 : -1, h != 0 ? c0 / h : -1})
      if (t > 0) way = std::min(way, t);
  }
  return way;
}

// Limited-memory quasi-Newton direction; `solve` applies the first guess of the inverse.
class History {
 public:
  template <class Solve>
  Field direction(const Field& gradient, const Solve& solve) const {
    Field q = gradient;
    std::vector<double> a(steps_.size());
    for (size_t i = steps_.size(); i-- > 0;) {
      a[i] = steps_[i].dot(q) / steps_[i].dot(changes_[i]);
      q -= a[i] * changes_[i];
    }
    Field r = solve(q);
    for (size_t i = 0; i < steps_.size(); ++i)
      r += (a[i] - changes_[i].dot(r) / steps_[i].dot(changes_[i])) * steps_[i];
    return -r;
  }
  void add(const Field& step, const Field& change) {
    if (!(step.dot(change) > 1e-12 * step.norm() * change.norm())) return;
    steps_.push_back(step), changes_.push_back(change);
    if (steps_.size() > kHistory) steps_.pop_front(), changes_.pop_front();
  }
  void clear() { steps_.clear(), changes_.clear(); }
  bool empty() const { return steps_.empty(); }

 private:
  std::deque<Field> steps_, changes_;
};

struct Step {
  Field x;  // empty: none lowers the energy enough
  double value = 0;
};

// Halves the step until the energy falls by a share of what the slope promises and the border stays simple.
Step line_search(const MapEnergy& energy, const FlatteningProblem& problem, const Field& x, double value,
                 const Field& d, double slope) {
  for (double t = std::min(1.0, kShareOfWayToFlip * way_to_flip(problem.F, x, d)); t > kLeastStep; t *= 0.5) {
    const Field moved = x + t * d;
    const double next = energy.value(moved);
    if (next <= value + kSufficientGain * t * slope && border_is_simple(as_uv(moved), problem.border))
      return {moved, next};
  }
  return {};
}

Field symmetric_part(const Field& x, const std::vector<int>& mirror) {
  if (mirror.empty()) return x;
  const TexCoords even = symmetrised(as_uv(x), mirror);
  return Eigen::Map<const Field>(even.data(), even.size());
}

}  // namespace

double geodesic_stress(const TexCoords& uv, const SurfaceDistances& distances, Eigen::Index count) {
  double dd = 0, ll = 0, dl = 0;
  for (size_t i = 0; i < distances.sources.size(); ++i) {
    if (distances.sources[i] >= count) continue;
    const Eigen::RowVector2d at = uv.row(distances.sources[i]);
    const Eigen::VectorXd length = (uv.topRows(count).rowwise() - at).rowwise().norm();
    const Eigen::VectorXd d = distances.D.row(static_cast<Eigen::Index>(i)).head(count);
    dd += d.squaredNorm(), ll += length.squaredNorm(), dl += d.dot(length);
  }
  return std::sqrt(std::max(0.0, 1 - dl * dl / (ll * dd)));
}

FlatteningResult flatten(const FlatteningProblem& problem, const TexCoords& start, double stretch_weight,
                         int iterations) {
  const MapEnergy energy(problem, start, stretch_weight);
  FlatteningResult result{start, 0, "iterations used up"};
  Field x = Eigen::Map<const Field>(start.data(), start.size()), last_gradient, last_step;
  double value = energy.value(x);
  History history;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor;
  while (result.iterations < iterations) {
    const MapEnergy::Terms terms = energy.terms(x);
    const Field gradient = symmetric_part(terms.gradient, problem.mirror);
    if (last_step.size() > 0) history.add(last_step, gradient - last_gradient);
    if (result.iterations == 0) factor.analyzePattern(terms.hessian);
    factor.factorize(terms.hessian);
    // Rounding may leave a matrix that cannot be factored; its diagonal is a guess of the inverse as well, if a poor
    // one.
    const Field direction = history.direction(gradient, [&](const Field& r) -> Field {
      if (factor.info() == Eigen::Success) return factor.solve(r);
      return r.cwiseQuotient(terms.hessian.diagonal());
    });
    Field d = symmetric_part(direction, problem.mirror);
    if (!d.allFinite() || !(d.dot(gradient) < 0))
      d = symmetric_part(-gradient.cwiseQuotient(terms.hessian.diagonal()), problem.mirror);
    const Step step = line_search(energy, problem, x, value, d, d.dot(gradient));
    ++result.iterations;
    if (step.x.size() == 0) {
      if (history.empty()) {
        result.stop = "no step lowers the energy";
        break;
      }
      history.clear();
      last_step.resize(0);
      continue;
    }
    const double gain = value - step.value;
    last_step = step.x - x, last_gradient = gradient;
    x = step.x, value = step.value;
    if (gain < kLeastGain * value) {
      result.stop = "converged";
      break;
    }
  }
  result.uv = as_uv(x);
  return result;
}

}  // namespace facewright
