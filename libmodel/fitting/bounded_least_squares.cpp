// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/bounded_least_squares.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

class ActiveSet {
 public:
  ActiveSet(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, const Eigen::VectorXd& lower,
            const Eigen::VectorXd& upper)
      : H_(H.selfadjointView<Eigen::Lower>()), g_(g), lower_(lower), upper_(upper), is_free_(to_size(g), false) {
    result_.x = Eigen::VectorXd::Zero(g.size()).cwiseMax(lower).cwiseMin(upper);
    for (Eigen::Index i = 0; i < g.size(); ++i)
      is_free_[to_size(i)] = lower[i] < result_.x[i] && result_.x[i] < upper[i];
  }

  BoundedLeastSquaresResult run() {
    const auto limit = static_cast<int>(3 * g_.size() + 10);
    solve_free(limit);
    while (result_.summary.iterations < limit) {
      const Eigen::Index worst = most_wanting_to_move();
      if (worst < 0) {
        result_.summary.converged = true;
        break;
      }
      is_free_[to_size(worst)] = true;
      solve_free(limit);
    }
    for (Eigen::Index i = 0; i < g_.size(); ++i)
      if (is_free_[to_size(i)]) result_.free.push_back(static_cast<int>(i));
    return std::move(result_);
  }

 private:
  static size_t to_size(const Eigen::VectorXd& x) { return static_cast<size_t>(x.size()); }
  static size_t to_size(Eigen::Index i) { return static_cast<size_t>(i); }

  /// The variable at a bound whose gradient points furthest inwards, -1 if the bounds hold all of them back.
  Eigen::Index most_wanting_to_move() const {
    const Eigen::VectorXd descent = g_ - H_ * result_.x;
    Eigen::Index worst = -1;
    double most = 0;
    for (Eigen::Index i = 0; i < g_.size(); ++i) {
      if (is_free_[to_size(i)] || lower_[i] == upper_[i]) continue;
      const double inwards = result_.x[i] == lower_[i] ? descent[i] : -descent[i];
      const double rounding = 1e-12 * (std::abs(g_[i]) + H_.row(i).cwiseAbs() * result_.x.cwiseAbs());
      if (inwards > std::max(most, rounding)) most = inwards, worst = i;
    }
    return worst;
  }

  /// Solves for the free variables; those that would leave their bounds stop there and are free no more.
  void solve_free(int limit) {
    while (result_.summary.iterations < limit) {
      std::vector<Eigen::Index> free;
      for (Eigen::Index i = 0; i < g_.size(); ++i)
        if (is_free_[to_size(i)]) free.push_back(i);
      if (free.empty()) return;
      ++result_.summary.iterations;
      Eigen::VectorXd bound = result_.x;
      bound(free).setZero();
      Eigen::MatrixXd K = H_(free, free);
      K.diagonal().array() += 1e-14 * std::max(K.diagonal().maxCoeff(), std::numeric_limits<double>::min());
      const Eigen::VectorXd rest = g_ - H_ * bound;
      const Eigen::VectorXd target = K.ldlt().solve(rest(free));
      const Eigen::VectorXd from = result_.x(free);
      double step = 1;
      Eigen::Index stopped = -1;
      for (Eigen::Index j = 0; j < target.size(); ++j) {
        const double wall = std::clamp(target[j], lower_[free[to_size(j)]], upper_[free[to_size(j)]]);
        if (wall == target[j]) continue;
        const double reach = (wall - from[j]) / (target[j] - from[j]);
        if (reach < step) step = reach, stopped = j;
      }
      const Eigen::VectorXd to = from + step * (target - from);
      for (Eigen::Index j = 0; j < to.size(); ++j) {
        const Eigen::Index i = free[to_size(j)];
        result_.x[i] = std::clamp(to[j], lower_[i], upper_[i]);
      }
      if (stopped < 0) return;
      const Eigen::Index i = free[to_size(stopped)];
      result_.x[i] = target[stopped] > from[stopped] ? upper_[i] : lower_[i];
      is_free_[to_size(i)] = false;
    }
  }

  Eigen::MatrixXd H_;
  Eigen::VectorXd g_, lower_, upper_;
  std::vector<bool> is_free_;
  BoundedLeastSquaresResult result_;
};

}  // namespace

BoundedLeastSquaresResult minimise_bounded(const Eigen::MatrixXd& H, const Eigen::VectorXd& g,
                                           const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
  if (H.rows() != g.size() || H.cols() != g.size() || lower.size() != g.size() || upper.size() != g.size())
    throw InvalidInput("bounded least squares: the sizes do not agree");
  if (!(lower.array() <= upper.array()).all()) throw InvalidInput("bounded least squares: expected lower <= upper");
  return ActiveSet(H, g, lower, upper).run();
}

BoundedLeastSquaresResult bounded_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                                                const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                                                double ridge) {
  if (A.rows() != b.size()) throw InvalidInput("bounded least squares: the sizes do not agree");
  Eigen::MatrixXd H = A.transpose() * A;
  H.diagonal().array() += ridge;
  return minimise_bounded(H, A.transpose() * b, lower, upper);
}

}  // namespace facewright
