// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/fit_scan.h"

#include <algorithm>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/core/median.h"
#include "libmodel/fitting/fit_shape.h"
#include "libmodel/fitting/scan_surface.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

void check(const FitScanOptions& o) {
  const auto expect = [](bool ok, const char* what) {
    if (!ok) throw InvalidInput(std::string("fit to a scan: expected ") + what);
  };
  expect(o.lambda >= 0, "lambda >= 0");
  expect(o.sigma_mm > 0 && o.landmark_sigma_mm > 0, "sigma_mm and landmark_sigma_mm > 0");
  expect(o.independent >= 1, "independent >= 1");
  expect(o.slide >= 0 && o.slide <= 1, "slide from 0 to 1");
  expect(o.largest_distance_mm > 0, "largest_distance_mm > 0");
  expect(o.trimmed >= 0 && o.trimmed <= 0.9, "trimmed from 0 to 0.9");
  expect(o.iterations >= 1, "iterations >= 1");
}

class ScanFit {
 public:
  ScanFit(const MorphableModel& model, const Mesh& scan, const FitScanOptions& options)
      : model_(model), options_(options), scan_((validate(scan), scan), options.threads) {
    check(options);
    const PcaModel* expression = options.expression && model.expression() ? &*model.expression() : nullptr;
    std::vector<Observation> all(static_cast<size_t>(model.vertex_count()));
    for (size_t i = 0; i < all.size(); ++i) all[i].vertex = static_cast<int>(i);
    rows_ = landmark_shape_model(all, model.shape(), options.modes, expression);
    expression_modes_ = expression ? expression->mode_count() : 0;
    fit_.coefficients = Eigen::VectorXd::Zero(rows_.basis.cols());
    result_.summary.options = options;
    result_.summary.spacing_mm = scan_.spacing;
  }

  void start(const Similarity& scan_from_model) { fit_.scan_from_model = scan_from_model; }
  void start(const Landmarks& landmarks, const LandmarkMapper& mapper) {
    FitPointsOptions o;
    o.lambda = options_.lambda;
    o.sigma_mm = options_.landmark_sigma_mm;
    o.scaling = options_.scaling;
    o.modes = options_.modes;
    o.expression = options_.expression;
    const FitPointsResult at = fit_points(model_, landmarks, o, mapper);
    fit_.scan_from_model = at.scan_from_model;
    fit_.coefficients << at.shape_coefficients, at.expression_coefficients;
    for (const PointResidual& r : at.summary.residuals) {
      const double sigma = landmarks.at(r.name).stddev > 0 ? landmarks.at(r.name).stddev : options_.landmark_sigma_mm;
      guides_.push_back({r.vertex, r.measured, 1 / (sigma * sigma)});
    }
  }

  FitScanResult run() {
    const int last = options_.level < 0 ? model_.level_count() - 1 : options_.level;
    if (last >= model_.level_count()) throw InvalidInput("fit to a scan: the model has no such level");
    for (int level = 0; level <= last; ++level) run_level(level);
    FitScanResult& r = result_;
    r.scan_from_model = fit_.scan_from_model;
    r.shape_coefficients = fit_.coefficients.head(fit_.coefficients.size() - expression_modes_);
    r.expression_coefficients = fit_.coefficients.tail(expression_modes_);
    r.coefficient_stddevs = covariance_.diagonal().cwiseMax(0).cwiseSqrt();
    r.fitted = posed(model_.vertex_count());
    r.summary.stop = r.summary.levels.back().stop;
    ScanMatches last_matches = match_to_scan(scan_, r.fitted, vertex_normals(r.fitted, model_.faces()), reach_,
                                             options_.largest_angle_deg, options_.threads);
    r.distances = std::move(last_matches.distance);
    r.matches = std::move(last_matches.state);
    return std::move(r);
  }

 private:
  struct Guide {
    int vertex;
    Eigen::Vector3d position;
    double weight;
  };

  Vertices posed(Eigen::Index n) const {
    const Eigen::VectorXd x = rows_.mean.head(3 * n) + rows_.basis.topRows(3 * n) * fit_.coefficients;
    return fit_.scan_from_model.apply(as_vertices(x));
  }

  void run_level(int level) {
    ScanLevelSummary summary;
    summary.vertices = model_.vertex_count(level);
    summary.stop = FitStop::iteration_limit;
    while (summary.iterations < options_.iterations) {
      const Eigen::VectorXd before = fit_.coefficients;
      round(level);
      ++summary.iterations;
      summary.last_change = before.size() > 0 ? (fit_.coefficients - before).cwiseAbs().maxCoeff() : 0;
      if (summary.last_change > options_.tolerance || reach_ > 5) continue;
      summary.stop = FitStop::converged;
      break;
    }
    result_.summary.levels.push_back(summary);
  }

  /// Matches and one step.
  void round(int level) {
    const Vertices V = posed(model_.vertex_count(level)), N = vertex_normals(V, model_.faces(level));
    if (rounds_++ == 0)
      reach_ = std::max(options_.largest_distance_mm, 5.0);
    else
      reach_ = std::max(reach_ / 2, 5.0);
    ScanMatches m = match_to_scan(scan_, V, N, reach_, options_.largest_angle_deg, options_.threads);
    const double spread = std::max(trim(m, options_.trimmed), options_.sigma_mm);
    report(m);
    if (result_.summary.matched < 20)
      throw SolverError("fit to a scan: only " + std::to_string(result_.summary.matched) +
                        " vertices of the face lie near the scan; check the landmarks, the pose and the unit (mm)");
    const Eigen::VectorXd area = vertex_areas(V, model_.faces(level));
    collect(m, area / area.sum(), spread);
    fit_ = step_to_points(fit_, chosen_, targets_, options_.lambda, options_.scaling, &covariance_);
  }

  void report(const ScanMatches& m) {
    FitScanSummary& s = result_.summary;
    const auto count = [&](ScanMatch state) {
      return static_cast<int>(std::count(m.state.begin(), m.state.end(), state));
    };
    s.vertices = static_cast<int>(m.state.size());
    s.matched = count(ScanMatch::counts);
    s.beyond = count(ScanMatch::beyond);
    s.at_rim = count(ScanMatch::at_rim);
    s.turned = count(ScanMatch::turned);
    s.trimmed = count(ScanMatch::trimmed);
    std::vector<double> size;
    for (size_t k = 0; k < m.state.size(); ++k)
      if (m.state[k] == ScanMatch::counts) size.push_back(std::abs(m.distance[static_cast<Eigen::Index>(k)]));
    s.median_mm = median_of(size);
  }

  /// Targets: the vertex moved along the scan's normal onto the scan, with Welsch's weights.
  void collect(const ScanMatches& m, const Eigen::VectorXd& share, double spread) {
    const Eigen::Index K = result_.summary.matched + static_cast<Eigen::Index>(guides_.size()), M = rows_.basis.cols();
    chosen_.mean.resize(3 * K);
    chosen_.basis.resize(3 * K, M);
    targets_ = {Vertices(K, 3), Vertices::Zero(K, 3), Eigen::VectorXd(K), Eigen::VectorXd(K)};
    Eigen::Index k = 0;
    const auto put = [&](Eigen::Index vertex) {
      chosen_.mean.segment<3>(3 * k) = rows_.mean.segment<3>(3 * vertex);
      chosen_.basis.middleRows<3>(3 * k) = rows_.basis.middleRows<3>(3 * vertex);
    };
    const Vertices V = posed(static_cast<Eigen::Index>(m.state.size()));
    for (size_t i = 0; i < m.state.size(); ++i) {
      if (m.state[i] != ScanMatch::counts) continue;
      const auto row = static_cast<Eigen::Index>(i);
      put(row);
      const double d = m.distance[row], robust = std::exp(-d * d / (2 * 9 * spread * spread));
      targets_.normals.row(k) = scan_.N.row(m.point[i]);
      targets_.positions.row(k) = V.row(row) - d * targets_.normals.row(k);
      targets_.across[k] = robust * share[row] * options_.independent / (options_.sigma_mm * options_.sigma_mm);
      targets_.along[k] = targets_.across[k] * options_.slide;
      ++k;
    }
    for (const Guide& guide : guides_) {
      put(guide.vertex);
      targets_.positions.row(k) = guide.position.transpose();
      targets_.across[k] = targets_.along[k] = guide.weight;
      ++k;
    }
  }

  const MorphableModel& model_;
  FitScanOptions options_;
  ScanSurface scan_;
  LandmarkShapeModel rows_;    ///< all vertices
  LandmarkShapeModel chosen_;  ///< the matched ones of this round, landmarks last
  PointTargets targets_;
  Eigen::Index expression_modes_ = 0;
  std::vector<Guide> guides_;
  PointFit fit_;
  Eigen::MatrixXd covariance_;
  double reach_ = 0;
  int rounds_ = 0;
  FitScanResult result_;
};

}  // namespace

FitScanResult fit_scan(const MorphableModel& model, const Mesh& scan, const Landmarks& landmarks,
                       const FitScanOptions& options, const LandmarkMapper& mapper) {
  ScanFit fit(model, scan, options);
  fit.start(landmarks, mapper);
  return fit.run();
}

FitScanResult fit_scan(const MorphableModel& model, const Mesh& scan, const Similarity& scan_from_model,
                       const FitScanOptions& options) {
  ScanFit fit(model, scan, options);
  fit.start(scan_from_model);
  return fit.run();
}

}  // namespace facewright
