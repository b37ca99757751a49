// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/fit_scan.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/core/median.h"
#include "libmodel/core/parallel.h"
#include "libmodel/core/topology.h"
#include "libmodel/fitting/fit_shape.h"
#include "libmodel/fitting/point_tree.h"
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

/// Normals of points without triangles: the direction of least spread of the nearest 12, sign unknown.
Vertices cloud_normals(const Vertices& V, const PointTree& tree, int threads) {
  Vertices N(V.rows(), 3);
  parallel_blocks(static_cast<int>(V.rows()), threads, [&](int first, int last) {
    for (int i = first; i < last; ++i) {
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      const auto near = tree.nearest(V.row(i).transpose(), 12);
      for (const auto& n : near) mean += V.row(n.row).transpose() / static_cast<double>(near.size());
      Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
      for (const auto& n : near) {
        const Eigen::Vector3d d = V.row(n.row).transpose() - mean;
        C += d * d.transpose();
      }
      N.row(i) = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(C).eigenvectors().col(0).transpose();
    }
  });
  return N;
}

/// Points that belong to a triangle, or all if there are none.
std::vector<int> used_points(const Mesh& scan) {
  std::vector<bool> used(static_cast<size_t>(scan.V.rows()), scan.F.rows() == 0);
  for (Eigen::Index i = 0; i < scan.F.size(); ++i) used[static_cast<size_t>(scan.F.data()[i])] = true;
  std::vector<int> rows;
  for (size_t i = 0; i < used.size(); ++i)
    if (used[i]) rows.push_back(static_cast<int>(i));
  return rows;
}

/// The scan, ready to be asked for the nearest point.
struct ScanSurface {
  ScanSurface(const Mesh& scan, int threads)
      : rows(used_points(scan)), V(scan.V(rows, Eigen::all)), tree(V), oriented(scan.F.rows() > 0) {
    if (V.rows() < 12)
      throw InvalidInput("fit to a scan: expected at least 12 points, got " + std::to_string(V.rows()));
    if (oriented) {
      N = vertex_normals(scan.V, scan.F)(rows, Eigen::all);
      const std::vector<bool> rim = boundary_vertices(scan.V.rows(), scan.F);
      for (const int row : rows) at_rim.push_back(rim[static_cast<size_t>(row)]);
    } else {
      N = cloud_normals(V, tree, threads);
      at_rim.assign(rows.size(), false);
    }
    const int step = std::max<int>(1, static_cast<int>(V.rows()) / 2000);
    std::vector<double> gaps;
    for (int i = 0; i < V.rows(); i += step)
      gaps.push_back(std::sqrt(tree.nearest(V.row(i).transpose(), 2).back().squared_distance));
    spacing = median_of(gaps);
  }
  std::vector<int> rows;  ///< of the scan
  Vertices V, N;
  PointTree tree;
  bool oriented;
  std::vector<bool> at_rim;
  double spacing = 0;
};

enum class Match : char { counts, beyond, at_rim, turned, trimmed };

struct Matches {
  std::vector<Match> state;
  std::vector<int> point;    ///< of the scan surface
  Eigen::VectorXd distance;  ///< along the scan's normal, signed
};

Matches match(const ScanSurface& scan, const Vertices& V, const Vertices& N, double reach, const FitScanOptions& o) {
  Matches out;
  const auto n = static_cast<size_t>(V.rows());
  out.state.assign(n, Match::beyond);
  out.point.assign(n, -1);
  out.distance = Eigen::VectorXd::Zero(V.rows());
  const double least = std::cos(o.largest_angle_deg * std::numbers::pi / 180);
  const double aside = std::max(2.5 * scan.spacing, 1e-9);
  parallel_blocks(static_cast<int>(n), o.threads, [&](int first, int last) {
    for (int i = first; i < last; ++i) {
      const auto k = static_cast<size_t>(i);
      const Eigen::Vector3d x = V.row(i).transpose();
      const int row = scan.tree.nearest(x, reach).row;
      if (row < 0) continue;
      out.point[k] = row;
      const Eigen::Vector3d normal = scan.N.row(row).transpose();
      const Eigen::Vector3d d = x - scan.V.row(row).transpose();
      const double along = normal.dot(d), agree = N.row(i).dot(scan.N.row(row));
      out.distance[i] = along;
      if (!((scan.oriented ? agree : std::abs(agree)) >= least))
        out.state[k] = Match::turned;
      else if (scan.at_rim[static_cast<size_t>(row)] || (d - along * normal).norm() > aside + 0.3 * std::abs(along))
        out.state[k] = Match::at_rim;
      else
        out.state[k] = Match::counts;
    }
  });
  return out;
}

/// Leaves out the worst share; returns the robust standard deviation of the rest, mm.
double trim(Matches& m, double share) {
  std::vector<double> size;
  for (size_t k = 0; k < m.state.size(); ++k)
    if (m.state[k] == Match::counts) size.push_back(std::abs(m.distance[static_cast<Eigen::Index>(k)]));
  if (size.empty()) return 0;
  std::vector<double> sorted = size;
  const double median = median_of(sorted);
  std::sort(sorted.begin(), sorted.end());
  const double limit =
      sorted[std::min(sorted.size() - 1, static_cast<size_t>((1 - share) * static_cast<double>(sorted.size())))];
  for (size_t k = 0; k < m.state.size(); ++k)
    if (m.state[k] == Match::counts && std::abs(m.distance[static_cast<Eigen::Index>(k)]) > limit)
      m.state[k] = Match::trimmed;
  return 1.4826 * median;
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
    Matches m = match(scan_, V, N, reach_, options_);
    const double spread = std::max(trim(m, options_.trimmed), options_.sigma_mm);
    report(m);
    if (result_.summary.matched < 20)
      throw SolverError("fit to a scan: only " + std::to_string(result_.summary.matched) +
                        " vertices of the face lie near the scan; check the landmarks, the pose and the unit (mm)");
    const Eigen::VectorXd area = vertex_areas(V, model_.faces(level));
    collect(m, area / area.sum(), spread);
    fit_ = step_to_points(fit_, chosen_, targets_, options_.lambda, options_.scaling, &covariance_);
  }

  void report(const Matches& m) {
    FitScanSummary& s = result_.summary;
    const auto count = [&](Match state) { return static_cast<int>(std::count(m.state.begin(), m.state.end(), state)); };
    s.vertices = static_cast<int>(m.state.size());
    s.matched = count(Match::counts);
    s.beyond = count(Match::beyond);
    s.at_rim = count(Match::at_rim);
    s.turned = count(Match::turned);
    s.trimmed = count(Match::trimmed);
    std::vector<double> size;
    for (size_t k = 0; k < m.state.size(); ++k)
      if (m.state[k] == Match::counts) size.push_back(std::abs(m.distance[static_cast<Eigen::Index>(k)]));
    s.median_mm = median_of(size);
  }

  /// Targets: the vertex moved along the scan's normal onto the scan, with Welsch's weights.
  void collect(const Matches& m, const Eigen::VectorXd& share, double spread) {
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
      if (m.state[i] != Match::counts) continue;
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
