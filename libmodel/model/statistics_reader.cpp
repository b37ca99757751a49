// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/statistics_reader.h"

#include <cmath>
#include <optional>
#include <sstream>

#include "libmodel/model/basis_reader.h"

namespace facewright {
namespace {

constexpr double kDefect = 1e-3;  // of B'(B r) - r; float32 leaves 1e-5, a scaled or cut basis more than 0.1

std::string text(double x) {
  std::ostringstream out;
  out << x;
  return out.str();
}

std::string size_text(Eigen::Index rows, Eigen::Index cols) {
  return std::to_string(rows) + " x " + std::to_string(cols);
}

// Statismo's minor version: the group's own, the file's, or unknown.
std::optional<int> minor_version(const Hdf5Reader& h5, const std::string& group) {
  for (const std::string& at : {group + "/version", std::string("/version")})
    if (h5.has(at + "/minorVersion")) {
      const int major = read_integer(h5, at + "/majorVersion"), minor = read_integer(h5, at + "/minorVersion");
      if (!(major == 0 && (minor == 8 || minor == 9)) && major != 1)
        h5.fail(at, "is " + std::to_string(major) + "." + std::to_string(minor) +
                        "; readable are 0.8, 0.9 and 1. Write the model again with a current statismo or scalismo");
      return major == 1 ? 9 : minor;
    }
  return std::nullopt;
}

void check_finite(const Hdf5Reader& h5, const std::string& path, const Eigen::VectorXd& values) {
  for (Eigen::Index i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i]))
      h5.fail(path, "holds NaN or infinity at entry " + std::to_string(i) +
                        " (from 0); the file is damaged or its PCA failed: make it again");
}

void check_variances(const Hdf5Reader& h5, const std::string& path, const Eigen::VectorXd& variances) {
  check_finite(h5, path, variances);
  for (Eigen::Index i = 0; i < variances.size(); ++i)
    if (variances[i] < 0 || (i > 0 && variances[i] > variances[i - 1]))
      h5.fail(path, "has variance " + std::to_string(i + 1) + " = " + text(variances[i]) +
                        (i > 0 ? " after " + text(variances[i - 1]) : "") +
                        "; expected variances >= 0 in descending order. Sort the modes, basis columns with them");
}

[[noreturn]] void fail_not_finite(const Hdf5Reader& h5, const std::string& path, const Eigen::MatrixXd& basis) {
  for (Eigen::Index i = 0; i < basis.rows(); ++i)
    for (Eigen::Index k = 0; k < basis.cols(); ++k)
      if (!std::isfinite(basis(i, k)))
        h5.fail(path, "holds NaN or infinity at row " + std::to_string(i) + ", column " + std::to_string(k) +
                          " (from 0); the file is damaged or its PCA failed: make it again");
  h5.fail(path, "holds numbers too large for a basis; the file is damaged");
}

// 0.8 stores basis * diag(sqrt(variances)). Without a version, the length of the first column tells.
bool is_scaled(std::optional<int> minor, const PcaModel& pca) {
  if (minor) return *minor == 8;
  const double length = pca.basis.col(0).squaredNorm(), variance = pca.variances[0];
  return std::abs(length - variance) < std::abs(length - 1);
}

void check_orthonormal(const Hdf5Reader& h5, const std::string& path, double defect) {
  if (defect > kDefect)
    h5.fail(path, "does not have orthonormal columns: |B'Br - r| = " + text(defect) +
                      " for a test vector r, expected " + text(kDefect) +
                      " at most. If columns are scaled by the standard deviations, divide them or state version 0.8; "
                      "if rows were cut off, orthonormalise");
}

// In place of B'(B r) of the stored numbers, where the basis is not what is stored.
double defect_of(const Eigen::MatrixXd& B) {
  Eigen::VectorXd r = Eigen::VectorXd::LinSpaced(B.cols(), 0.5, 1.5);
  for (Eigen::Index k = 1; k < B.cols(); k += 2) r[k] = -r[k];
  return (B.transpose() * (B * r) - r).cwiseAbs().maxCoeff();
}

}  // namespace

Eigen::VectorXd read_column(const Hdf5Reader& h5, const std::string& path) {
  const RowMatrixXd m = h5.matrix(path);
  if (m.cols() != 1 && m.rows() != 1)
    h5.fail(path, "is a matrix of " + size_text(m.rows(), m.cols()) + "; expected a vector");
  return Eigen::Map<const Eigen::VectorXd>(m.data(), m.size());
}

int read_integer(const Hdf5Reader& h5, const std::string& path) {
  const RowMatrixXi value = h5.integers(path);
  if (value.size() != 1) h5.fail(path, "holds " + std::to_string(value.size()) + " numbers; expected one");
  return value(0, 0);
}

PcaModel read_statistics(const Hdf5Reader& h5, const std::string& group, const StatisticsRequest& request) {
  const std::string at = group + "/model", basis = at + "/pcaBasis";
  PcaModel pca;
  pca.mean = read_column(h5, at + "/mean");
  pca.variances = read_column(h5, at + "/pcaVariance");
  check_finite(h5, at + "/mean", pca.mean);
  if (pca.mean.size() % 3 != 0)
    h5.fail(at + "/mean", "has " + std::to_string(pca.mean.size()) + " values; expected three per vertex");
  check_variances(h5, at + "/pcaVariance", pca.variances);
  const Hdf5Reader::Shape shape = h5.shape(basis);
  if (shape.rows != pca.mean.size() || shape.cols != pca.variances.size())
    h5.fail(basis, "is " + size_text(shape.rows, shape.cols) + "; expected " +
                       size_text(pca.mean.size(), pca.variances.size()) + " from mean and pcaVariance");
  if (request.values > pca.mean.size())
    h5.fail(basis, "has " + std::to_string(shape.rows) + " rows, a level of the file " +
                       std::to_string(request.values) + ": the levels do not nest");
  const auto minor = minor_version(h5, group);
  Eigen::Index modes = pca.mode_count();
  while (modes > 0 && pca.variances[modes - 1] == 0) --modes;
  pca.variances.conservativeResize(modes);
  if (request.values >= 0) pca.mean.conservativeResize(request.values);
  BasisRows rows = read_basis(h5, basis, shape, pca.mean.size(), modes);
  pca.basis = std::move(rows.basis);
  if (!rows.finite) fail_not_finite(h5, basis, pca.basis);
  if (modes > 0 && is_scaled(minor, pca)) {
    pca.basis *= pca.variances.cwiseSqrt().cwiseInverse().asDiagonal();
    rows.defect = defect_of(pca.basis);
  }
  pca.orthonormal = request.orthonormal;
  if (pca.orthonormal) check_orthonormal(h5, basis, rows.defect);
  return pca;
}

}  // namespace facewright
