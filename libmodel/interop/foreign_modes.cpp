// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "libmodel/core/errors.h"
#include "libmodel/core/image.h"
#include "libmodel/core/random.h"
#include "libmodel/interop/foreign_model.h"

namespace facewright {
namespace {

constexpr double kUnitTolerance = 0.01;        // of a column's length: float16 and text keep three digits
constexpr double kOrthogonalTolerance = 2e-3;  // of the cosine of two columns

std::string text(double x) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.3g", x);
  return buffer;
}

// The largest cosine of two columns of unit length.
double largest_cosine(const Eigen::MatrixXd& unit) {
  Eigen::MatrixXd gram = unit.transpose() * unit;
  gram.diagonal().setZero();
  return gram.size() > 0 ? gram.cwiseAbs().maxCoeff() : 0;
}

void sort_by_variance(PcaModel& pca, const std::string& what, std::vector<std::string>& decisions) {
  std::vector<Eigen::Index> order(static_cast<size_t>(pca.mode_count()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return pca.variances[a] > pca.variances[b]; });
  if (std::is_sorted(order.begin(), order.end())) return;
  pca.basis = pca.basis(Eigen::all, order).eval();
  pca.variances = pca.variances(order).eval();
  decisions.push_back(what + ": modes sorted by their variance");
}

PcaModel made_orthonormal(PcaModel pca, const std::string& what, const std::string& why,
                          std::vector<std::string>& decisions) {
  decisions.push_back(what + ": columns are not " + why +
                      ": made orthonormal, the same faces with the same likelihood but other coefficients; "
                      "--keep-columns leaves them");
  pca.orthonormal = false;
  return pca.orthonormalised();
}

std::string not_orthogonal(double cosine) { return "orthogonal (cosines up to " + text(cosine) + ")"; }

double slope_of_linear(double encoded) {
  return encoded <= 0.04045 ? 1 / 12.92 : 2.4 / 1.055 * std::pow((encoded + 0.055) / 1.055, 1.4);
}

}  // namespace

PcaModel settled_modes(ForeignModes modes, const std::string& what, bool keep_columns,
                       std::vector<std::string>& decisions) {
  PcaModel pca;
  pca.mean = std::move(modes.mean);
  pca.basis = std::move(modes.columns);
  const Eigen::Index k = pca.basis.cols();
  if (pca.basis.rows() == 0 && k == 0) pca.basis.resize(pca.mean.size(), 0);
  pca.variances = Eigen::VectorXd::Ones(k);
  if (k == 0) return pca;
  const Eigen::VectorXd lengths = pca.basis.colwise().norm();
  const bool scaled = modes.scale == ModeScale::columns;
  if (!scaled) {
    pca.variances = modes.scale == ModeScale::sigmas ? Eigen::VectorXd(modes.values.cwiseAbs2()) : modes.values;
    decisions.push_back(
        what + ": " + std::to_string(k) + " modes, " +
        (modes.scale == ModeScale::sigmas ? "standard deviations given: squared" : "variances given: kept"));
    if ((lengths.array() - 1).abs().maxCoeff() > kUnitTolerance) {
      const std::string range = "of length 1 (" + text(lengths.minCoeff()) + " to " + text(lengths.maxCoeff()) + ")";
      if (!keep_columns) return made_orthonormal(std::move(pca), what, range, decisions);
      decisions.push_back(what + ": columns are not " + range + ", kept as asked");
      pca.orthonormal = false;
      sort_by_variance(pca, what, decisions);
      return pca;
    }
  } else if (lengths.minCoeff() <= 1e-9 * lengths.maxCoeff()) {
    if (!keep_columns) return made_orthonormal(std::move(pca), what, not_orthogonal(1), decisions);
  } else {
    const double cosine = largest_cosine(pca.basis * lengths.cwiseInverse().asDiagonal());
    if (cosine > kOrthogonalTolerance && !keep_columns)
      return made_orthonormal(std::move(pca), what, not_orthogonal(cosine), decisions);
    if (cosine <= kOrthogonalTolerance) {
      pca.variances = lengths.cwiseAbs2();
      pca.basis *= lengths.cwiseInverse().asDiagonal();
      decisions.push_back(what + ": basis scaled by sigma: divided, " + std::to_string(k) +
                          " modes; variances are the squared lengths");
      sort_by_variance(pca, what, decisions);
      return pca;
    }
  }
  if (scaled) {  // kept as asked
    pca.orthonormal = false;
    decisions.push_back(what + ": " + std::to_string(k) + " columns kept as asked, not orthogonal, variance 1 each");
    return pca;
  }
  if (const double cosine = largest_cosine(pca.basis); cosine > kOrthogonalTolerance) {
    if (!keep_columns) return made_orthonormal(std::move(pca), what, not_orthogonal(cosine), decisions);
    decisions.push_back(what + ": columns are not " + not_orthogonal(cosine) + ", kept as asked");
    pca.orthonormal = false;
  }
  sort_by_variance(pca, what, decisions);
  return pca;
}

PcaModel linearised_colours(const PcaModel& encoded, std::vector<std::string>& decisions) {
  PcaModel linear = encoded;
  const Eigen::VectorXd inside = encoded.mean.cwiseMax(0).cwiseMin(1);
  linear.mean = inside.unaryExpr([](double x) { return linear_from_srgb(x); });
  linear.basis = inside.unaryExpr([](double x) { return slope_of_linear(x); }).asDiagonal() * encoded.basis;
  linear.orthonormal = false;
  Random random(1);
  double squares = 0;
  constexpr int kDraws = 8;
  for (int i = 0; i < kDraws && encoded.mode_count() > 0; ++i) {
    const Eigen::VectorXd c = encoded.draw_coefficients(random);
    const Eigen::VectorXd truth = encoded.instance(c).cwiseMax(0).cwiseMin(1);
    const Eigen::VectorXd ours =
        linear.instance(c).unaryExpr([](double x) { return srgb_from_linear(std::clamp(x, 0.0, 1.0)); });
    squares += (truth - ours).squaredNorm() / static_cast<double>(truth.size());
  }
  decisions.push_back(
      "colours: taken as sRGB and made linear around the mean: the mean is exact, random faces differ by " +
      text(255 * std::sqrt(squares / kDraws)) +
      " of 255 steps (rms), since no linear model of light has the same faces");
  return encoded.mode_count() > 0 ? linear.orthonormalised() : linear;
}

}  // namespace facewright
