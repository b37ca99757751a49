// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/pca_model.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <string>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

constexpr double kNoVariance = 1e-6;  // standard deviation, of the first mode's: rounding of a basis kept as float32

}  // namespace

Eigen::VectorXd PcaModel::instance(const Eigen::VectorXd& c, Eigen::Index vertices) const {
  if (c.size() > mode_count())
    throw InvalidInput("model: got " + std::to_string(c.size()) + " coefficients for " + std::to_string(mode_count()) +
                       " modes");
  const Eigen::Index rows = vertices < 0 ? mean.size() : 3 * vertices;
  if (rows > mean.size()) throw InvalidInput("model: more vertices asked for than the model has");
  Eigen::VectorXd x = mean.head(rows);
  // Sums of columns rather than one matrix product: the rounding of an entry must not depend on the number of rows.
  // Four columns to a pass over x: the basis is read at the speed of the cache, and zeros behind the last change
  // nothing.
  const auto term = [&](Eigen::Index k) { return (c[k] * std::sqrt(variances[k])) * basis.col(k).head(rows); };
  Eigen::Index k = 0;
  for (; k + 4 <= c.size(); k += 4) x += term(k) + term(k + 1) + term(k + 2) + term(k + 3);
  if (c.size() - k == 3) x += term(k) + term(k + 1) + term(k + 2);
  if (c.size() - k == 2) x += term(k) + term(k + 1);
  if (c.size() - k == 1) x += term(k);
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

PcaModel PcaModel::orthonormalised() const { return orthonormal_level(*this).model; }

OrthonormalLevel orthonormal_level(const PcaModel& level) {
  const Eigen::Index modes = level.mode_count();
  OrthonormalLevel result{level, Eigen::MatrixXd::Identity(modes, modes)};
  result.model.orthonormal = true;
  if (level.orthonormal || modes == 0) return result;
  // W = Q R first: the singular values of R are those of W, and nothing is squared.
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(level.rescaled_basis());
  const Eigen::Index rows = std::min(level.mean.size(), modes);
  const Eigen::MatrixXd R = qr.matrixQR().topRows(rows).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(R, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd s = svd.singularValues();
  const Eigen::Index k = (s.array() > kNoVariance * s[0]).count();
  result.model.variances = s.head(k).cwiseAbs2();
  result.own_from_shared = svd.matrixV().leftCols(k).transpose();
  result.model.basis.setZero(level.mean.size(), k);
  result.model.basis.topRows(rows) = svd.matrixU().leftCols(k);
  result.model.basis.applyOnTheLeft(qr.householderQ());
  for (Eigen::Index j = 0; j < k; ++j) {
    Eigen::Index largest = 0;
    result.model.basis.col(j).cwiseAbs().maxCoeff(&largest);
    if (result.model.basis(largest, j) > 0) continue;
    result.model.basis.col(j) *= -1;
    result.own_from_shared.row(j) *= -1;
  }
  return result;
}

Eigen::VectorXd OrthonormalLevel::own(const Eigen::VectorXd& shared) const {
  if (shared.size() > own_from_shared.cols())
    throw InvalidInput("model: got " + std::to_string(shared.size()) + " coefficients for " +
                       std::to_string(own_from_shared.cols()) + " modes");
  return own_from_shared.leftCols(shared.size()) * shared;
}

Eigen::VectorXd OrthonormalLevel::shared(const Eigen::VectorXd& own) const {
  if (own.size() > own_from_shared.rows())
    throw InvalidInput("model: got " + std::to_string(own.size()) + " coefficients for " +
                       std::to_string(own_from_shared.rows()) + " modes");
  return own_from_shared.topRows(own.size()).transpose() * own;
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
