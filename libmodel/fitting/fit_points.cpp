// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/fit_points.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/fitting/fit_shape.h"

namespace facewright {
namespace {

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d M;
  M << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return M;
}

/// The pose after a small motion (rotation vector about `centre`, shift, log scale) in the model's frame.
Similarity moved(const Similarity& pose, const Eigen::VectorXd& step, const Eigen::Vector3d& centre) {
  Similarity small;
  const double angle = step.head<3>().norm();
  if (angle > 0) small.R = Eigen::AngleAxisd(angle, step.head<3>() / angle).toRotationMatrix();
  if (step.size() == 7) small.s = std::exp(std::clamp(step[6], -0.5, 0.5));
  small.t = step.segment<3>(3) + centre - small.s * (small.R * centre);
  Similarity out = pose * small;
  out.R = Eigen::Quaterniond(out.R).normalized().toRotationMatrix();
  return out;
}

void check(const FitPointsOptions& o) {
  const auto expect = [](bool ok, const char* what) {
    if (!ok) throw InvalidInput(std::string("fit to points: expected ") + what);
  };
  expect(o.lambda >= 0, "lambda >= 0");
  expect(o.sigma_mm > 0, "sigma_mm > 0");
  expect(o.iterations >= 1, "iterations >= 1");
  expect(o.tolerance >= 0, "tolerance >= 0");
}

/// Landmarks the model has, as observations (their pixel is not used), and the targets they are.
struct KnownLandmarks {
  std::vector<Observation> seen;
  PointTargets targets;
  std::vector<std::string> unknown;
};
KnownLandmarks known_landmarks(const MorphableModel& model, const Landmarks& landmarks, const FitPointsOptions& options,
                               const LandmarkMapper& mapper) {
  KnownLandmarks out;
  std::vector<LandmarkPoint<3>> marks;
  for (const auto& [name, mark] : landmarks) {
    const auto vertex = mapper.vertex(name, model.landmarks());
    if (!vertex || *vertex < 0 || *vertex >= model.vertex_count() || !mark.position.allFinite()) {
      out.unknown.push_back(name);
      continue;
    }
    Observation o;
    o.name = name;
    o.vertex = *vertex;
    out.seen.push_back(o);
    marks.push_back(mark);
  }
  const auto K = static_cast<Eigen::Index>(marks.size());
  if (K < 3)
    throw InvalidInput("fit to points: expected at least 3 landmarks that the model has, got " + std::to_string(K) +
                       " of " + std::to_string(landmarks.size()) + "; check the landmark names against the model's");
  out.targets.positions.resize(K, 3);
  out.targets.across.resize(K);
  for (Eigen::Index k = 0; k < K; ++k) {
    const LandmarkPoint<3>& mark = marks[static_cast<size_t>(k)];
    const double sigma = mark.stddev > 0 ? mark.stddev : options.sigma_mm;
    out.targets.positions.row(k) = mark.position.transpose();
    out.targets.across[k] = 1 / (sigma * sigma);
  }
  out.targets.along = out.targets.across;
  return out;
}

}  // namespace

PointFit step_to_points(const PointFit& from, const LandmarkShapeModel& model, const PointTargets& targets,
                        double lambda, Scaling scaling, Eigen::MatrixXd* covariance) {
  const Similarity& S = from.scan_from_model;
  const Eigen::Index K = targets.positions.rows(), M = model.basis.cols(), P = scaling == Scaling::free ? 7 : 6;
  const Vertices X = model.points(from.coefficients), Z = S.inverse().apply(targets.positions);
  const double total = targets.across.sum() + targets.along.sum();
  if (!(total > 0)) throw SolverError("fit to points: no point has any weight");
  const Eigen::Vector3d centre = X.transpose() * (targets.across + targets.along) / total;
  constexpr Eigen::Index block = 512;  // points whitened at a time
  RowMatrix A(3 * block, P + M + 1);   // [pose | shape | residual]
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(P + M + 1, P + M + 1);
  for (Eigen::Index first = 0; first < K; first += block) {
    const Eigen::Index count = std::min(block, K - first);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Index k = first + i;
      const double wn = S.s * std::sqrt(targets.across[k]), wt = S.s * std::sqrt(targets.along[k]);
      Eigen::Matrix3d L = wt * Eigen::Matrix3d::Identity();  // the root of the weight, in the model's frame
      if (wn != wt) {
        const Eigen::Vector3d n = S.R.transpose() * targets.normals.row(k).transpose();
        L += (wn - wt) * n * n.transpose();
      }
      auto rows = A.middleRows<3>(3 * i);
      const Eigen::Vector3d x = X.row(k).transpose() - centre;
      rows.leftCols<3>() = -L * cross_matrix(x);
      rows.middleCols<3>(3) = L;
      if (P == 7) rows.col(6) = L * x;
      rows.middleCols(P, M).noalias() = L * model.basis.middleRows<3>(3 * k);
      rows.col(P + M) = L * (Z.row(k).transpose() - model.mean.segment<3>(3 * k));
    }
    H.selfadjointView<Eigen::Lower>().rankUpdate(A.topRows(3 * count).transpose());
  }
  H.diagonal().segment(P, M).array() += lambda;
  Eigen::MatrixXd N = H.topLeftCorner(P + M, P + M).selfadjointView<Eigen::Lower>();
  const Eigen::VectorXd scale = N.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  N = (scale.asDiagonal() * N * scale.asDiagonal()).eval();
  if (lambda == 0) N.diagonal().array() += 1e-14;
  const Eigen::LDLT<Eigen::MatrixXd> solver(N);
  const Eigen::VectorXd u =
      scale.asDiagonal() * solver.solve(scale.asDiagonal() * H.row(P + M).head(P + M).transpose());
  if (solver.info() != Eigen::Success || !u.allFinite() || !(solver.rcond() > 1e-16))
    throw SolverError("fit to points: the points leave pose or shape undetermined");
  if (covariance)
    *covariance = (scale.asDiagonal() * solver.solve(Eigen::MatrixXd::Identity(P + M, P + M)) * scale.asDiagonal())
                      .bottomRightCorner(M, M);
  return {moved(S, u.head(P), centre), u.tail(M)};
}

FitPointsResult fit_points(const MorphableModel& model, const Landmarks& landmarks, const FitPointsOptions& options,
                           const LandmarkMapper& mapper) {
  check(options);
  FitPointsResult result;
  KnownLandmarks known = known_landmarks(model, landmarks, options, mapper);
  const PcaModel* expression = options.expression && model.expression() ? &*model.expression() : nullptr;
  const LandmarkShapeModel local = landmark_shape_model(known.seen, model.shape(), options.modes, expression);
  const Eigen::Index expression_modes = expression ? expression->mode_count() : 0;
  FitPointsSummary& summary = result.summary;
  summary.unknown = std::move(known.unknown);
  PointFit fit;
  fit.coefficients = Eigen::VectorXd::Zero(local.basis.cols());
  const auto pose = [&] {  // exact for this shape
    return fit_similarity(local.points(fit.coefficients), known.targets.positions, known.targets.across,
                          options.scaling);
  };
  fit.scan_from_model = pose();
  summary.stop = FitStop::iteration_limit;
  Eigen::MatrixXd covariance;
  while (summary.iterations < options.iterations) {
    const Eigen::VectorXd before = fit.coefficients;
    fit = step_to_points(fit, local, known.targets, options.lambda, options.scaling, &covariance);
    fit.scan_from_model = pose();
    ++summary.iterations;
    summary.last_change = before.size() > 0 ? (fit.coefficients - before).cwiseAbs().maxCoeff() : 0;
    if (summary.last_change > options.tolerance) continue;
    summary.stop = FitStop::converged;
    break;
  }
  result.scan_from_model = fit.scan_from_model;
  result.shape_coefficients = fit.coefficients.head(fit.coefficients.size() - expression_modes);
  result.expression_coefficients = fit.coefficients.tail(expression_modes);
  result.coefficient_stddevs = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Vertices fitted = fit.scan_from_model.apply(local.points(fit.coefficients));
  for (size_t k = 0; k < known.seen.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    summary.residuals.push_back({known.seen[k].name, known.seen[k].vertex, known.targets.positions.row(row).transpose(),
                                 fitted.row(row).transpose()});
  }
  summary.rms_mm = std::sqrt((fitted - known.targets.positions).rowwise().squaredNorm().mean());
  summary.options = options;
  return result;
}

}  // namespace facewright
