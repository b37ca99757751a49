// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/pca_model.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <string>

#include "libmodel/core/errors.h"

namespace facewright {

Eigen::VectorXd PcaModel::instance(const Eigen::VectorXd& c, Eigen::Index vertices) const {
  if (c.size() > mode_count())
    throw InvalidInput("model: got " + std::to_string(c.size()) + " coefficients for " + std::to_string(mode_count()) +
                       " modes");
  const Eigen::Index rows = vertices < 0 ? mean.size() : 3 * vertices;
  if (rows > mean.size()) throw InvalidInput("model: more vertices asked for than the model has");
  Eigen::VectorXd x = mean.head(rows);
  // Column by column rather than one matrix product: the rounding of an entry must not depend on the number of rows.
  for (Eigen::Index k = 0; k < c.size(); ++k) x += (c[k] * std::sqrt(variances[k])) * basis.col(k).head(rows);
  return x;
}

Eigen::VectorXd PcaModel::coefficients(const Eigen::VectorXd& x) const {
  const Eigen::Index n = x.size();
  if (n > mean.size() || n % 3 != 0 || n < mode_count())
    throw InvalidInput("model: cannot project " + std::to_string(n) + " values on " + std::to_string(mode_count()) +
                       " modes of " + std::to_string(mean.size()) + " values");
  const auto B = basis.topRows(n);
  Eigen::VectorXd y = B.transpose() * (x - mean.head(n));
  if (!orthonormal || n < mean.size()) {
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(mode_count(), mode_count());
    G.selfadjointView<Eigen::Lower>().rankUpdate(B.transpose());
    y = G.selfadjointView<Eigen::Lower>().ldlt().solve(y);
  }
  return (variances.array() > 0).select(y.array() / variances.array().sqrt(), 0.0);
}

Eigen::VectorXd PcaModel::project(const Eigen::VectorXd& x) const { return instance(coefficients(x), x.size() / 3); }

Eigen::VectorXd PcaModel::draw_coefficients(Random& random, double sigma) const {
  Eigen::VectorXd c(mode_count());
  for (auto& value : c) value = sigma * random.normal();
  return c;
}

PcaModel PcaModel::truncated(Eigen::Index k) const {
  k = std::clamp<Eigen::Index>(k, 0, mode_count());
  return {mean, basis.leftCols(k), variances.head(k), orthonormal};
}

PcaModel PcaModel::leading_rows(Eigen::Index n) const {
  if (n < 0 || n > vertex_count()) throw InvalidInput("model: more vertices asked for than the model has");
  return {mean.head(3 * n), basis.topRows(3 * n), variances, orthonormal && n == vertex_count()};
}

Eigen::MatrixXd PcaModel::rescaled_basis() const { return basis * variances.cwiseSqrt().asDiagonal(); }

PcaModel PcaModel::orthonormalised() const {
  if (orthonormal) return *this;
  const Eigen::MatrixXd W = rescaled_basis();
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(mode_count(), mode_count());
  G.selfadjointView<Eigen::Lower>().rankUpdate(W.transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(G);  // ascending; reads the lower triangle
  PcaModel result{mean, Eigen::MatrixXd(mean.size(), 0), Eigen::VectorXd(0), true};
  if (mode_count() == 0) return result;
  const Eigen::VectorXd lambda = eigen.eigenvalues().reverse();
  const Eigen::Index k = (lambda.array() > 1e-12 * lambda[0]).count();
  result.variances = lambda.head(k);
  result.basis = W * (eigen.eigenvectors().rowwise().reverse().leftCols(k) *
                      result.variances.cwiseSqrt().cwiseInverse().asDiagonal());
  // The normal equations square the condition number: one pass of Gram-Schmidt brings the small modes back to 1e-15.
  for (Eigen::Index j = 0; j < k; ++j) {
    result.basis.col(j) -= result.basis.leftCols(j) * (result.basis.leftCols(j).transpose() * result.basis.col(j));
    result.basis.col(j).normalize();
    Eigen::Index largest = 0;
    result.basis.col(j).cwiseAbs().maxCoeff(&largest);
    if (result.basis(largest, j) < 0) result.basis.col(j) *= -1;
  }
  return result;
}

void validate(const PcaModel& model) {
  const auto expect = [](bool ok, const std::string& what) {
    if (!ok) throw InvalidInput("model: " + what);
  };
  const Eigen::Index rows = model.mean.size(), k = model.variances.size();
  expect(rows % 3 == 0, "the mean has " + std::to_string(rows) + " values, not a multiple of 3");
  expect(model.basis.cols() == k && (k == 0 || model.basis.rows() == rows),
         "a basis of " + std::to_string(model.basis.rows()) + " x " + std::to_string(model.basis.cols()) +
             " does not fit a mean of " + std::to_string(rows) + " values and " + std::to_string(k) + " variances");
  expect(model.mean.allFinite() && model.basis.allFinite() && model.variances.allFinite(), "holds NaN or infinity");
  for (Eigen::Index i = 0; i < k; ++i)
    expect(model.variances[i] >= 0 && (i == 0 || model.variances[i] <= model.variances[i - 1]),
           "variance " + std::to_string(i + 1) + " is negative or out of order");
}

}  // namespace facewright
