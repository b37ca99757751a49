// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/fit_shape.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/fitting/model_rows.h"
#include "libmodel/fitting/normal_equations.h"

namespace facewright {

Vertices LandmarkShapeModel::points(const Eigen::VectorXd& coefficients) const {
  return as_vertices(mean + basis * coefficients);
}

LandmarkShapeModel landmark_shape_model(const std::vector<Observation>& seen, const PcaModel& shape, int modes,
                                        const PcaModel* expression) {
  const ModelRows rows(shape, modes, expression);
  LandmarkShapeModel out;
  rows.resize(out, static_cast<Eigen::Index>(seen.size()));
  for (size_t k = 0; k < seen.size(); ++k) rows.put(out, static_cast<Eigen::Index>(k), seen[k].vertex);
  return out;
}

namespace {

/// Least squares of least norm, the nuisance projected out of the rows themselves: nothing is squared.
ShapeResult without_prior(const WhitenedRows& all, Eigen::Index P, Eigen::Index M, bool with_covariance) {
  RowMatrix J = all.used().middleCols(P, M + 1);
  if (P > 0) {
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(all.used().leftCols(P));
    const Eigen::MatrixXd Q = qr.householderQ() * Eigen::MatrixXd::Identity(all.count, qr.rank());
    J -= Q * (Q.transpose() * J);
  }
  if (M == 0) return {Eigen::VectorXd(0), Eigen::MatrixXd(0, 0), {static_cast<int>(all.count), true}};
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(J.leftCols(M));
  ShapeResult result{solver.solve(J.col(M)), {}, {static_cast<int>(all.count), solver.rank() == M}};
  if (!with_covariance) return result;
  const Eigen::MatrixXd inverse = solver.pseudoInverse();
  result.covariance = inverse * inverse.transpose();
  if (!result.summary.determined) result.covariance.diagonal().setConstant(std::numeric_limits<double>::infinity());
  return result;
}

}  // namespace

Eigen::VectorXd ShapeResult::stddevs() const { return covariance.diagonal().cwiseSqrt(); }

ShapeResult fit_shape_posterior(const LandmarkShapeModel& model, const std::vector<Observation>& seen,
                                const AffineCamera& camera, const std::vector<Information>& W, double lambda,
                                const Eigen::MatrixXd& nuisance, bool with_covariance) {
  if (!(lambda >= 0)) throw InvalidInput("fit_shape: expected lambda >= 0");
  const Eigen::Index P = nuisance.cols(), M = model.basis.cols();
  WhitenedRows rows;
  whiten(rows, model, seen, camera, W, nuisance);
  if (lambda == 0) return without_prior(rows, P, M, with_covariance);
  Eigen::MatrixXd G;
  gram(G, rows);
  eliminate(G, P);
  G.diagonal().segment(P, M).array() += lambda;
  const Eigen::VectorXd g = G.row(P + M).segment(P, M).transpose();
  ShapeResult result{{}, {}, {static_cast<int>(rows.count), true}};
  if (PositiveDefiniteSolver solver; solver.compute(G.block(P, P, M, M))) {
    result.coefficients = solver.solve(g);
    if (with_covariance) result.covariance = solver.inverse();
    return result;
  }
  const Eigen::LDLT<Eigen::MatrixXd> pivoted(G.block(P, P, M, M));  // a prior of next to no weight
  result.coefficients = pivoted.solve(g);
  if (with_covariance) result.covariance = pivoted.solve(Eigen::MatrixXd::Identity(M, M));
  return result;
}

Eigen::VectorXd fit_shape(const LandmarkShapeModel& model, const std::vector<Observation>& seen,
                          const AffineCamera& camera, const std::vector<Information>& W, double lambda,
                          const Eigen::MatrixXd& nuisance) {
  return fit_shape_posterior(model, seen, camera, W, lambda, nuisance, false).coefficients;
}

}  // namespace facewright
