// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/refine_scan_fit.h"

#include <Eigen/SparseCholesky>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/core/median.h"
#include "libmodel/fitting/scan_surface.h"
#include "libmodel/geometry/laplacian.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

void check(const RefineOptions& o) {
  const auto expect = [](bool ok, const char* what) {
    if (!ok) throw InvalidInput(std::string("refinement: expected ") + what);
  };
  expect(o.smoothing_mm > 0, "smoothing_mm > 0");
  expect(o.fading > 0, "fading > 0");
  expect(o.largest_distance_mm > 0, "largest_distance_mm > 0");
  expect(o.trimmed >= 0 && o.trimmed <= 0.9, "trimmed from 0 to 0.9");
  expect(o.iterations >= 1, "iterations >= 1");
}

class Refinement {
 public:
  Refinement(const MorphableModel& model, const Mesh& scan, const FitScanResult& fit, const RefineOptions& options)
      : faces_(model.faces()), start_(fit.fitted), options_(options), scan_((validate(scan), scan), options.threads) {
    if (start_.rows() != model.vertex_count())
      throw InvalidInput("refinement: the fit has " + std::to_string(start_.rows()) + " vertices and the model " +
                         std::to_string(model.vertex_count()) + "; give the model it was made with");
    area_ = vertex_areas(start_, faces_).cwiseMax(1e-6);
    const Sparse K = cotangent_stiffness(start_, faces_);
    plate_ = std::pow(options.smoothing_mm, 4) * Sparse(K * area_.cwiseInverse().asDiagonal() * K);
    result_.V = start_;
    result_.offsets = Vertices::Zero(start_.rows(), 3);
    result_.summary.options = options;
  }

  RefinedFace run() {
    RefineSummary& s = result_.summary;
    s.stop = FitStop::iteration_limit;
    while (s.iterations < options_.iterations) {
      const Vertices before = result_.V;
      round();
      ++s.iterations;
      s.last_change_mm = std::sqrt((result_.V - before).rowwise().squaredNorm().mean());
      if (s.last_change_mm > options_.tolerance_mm) continue;
      s.stop = FitStop::converged;
      break;
    }
    report(match());
    return std::move(result_);
  }

 private:
  ScanMatches match() const {
    return match_to_scan(scan_, result_.V, vertex_normals(result_.V, faces_), options_.largest_distance_mm,
                         options_.largest_angle_deg, options_.threads);
  }

  void round() {
    ScanMatches m = match();
    const double spread = std::max(trim(m, options_.trimmed), 0.1);
    Eigen::VectorXd weight = options_.fading * area_;
    Vertices pull = Vertices::Zero(start_.rows(), 3);
    for (Eigen::Index i = 0; i < start_.rows(); ++i) {
      const auto k = static_cast<size_t>(i);
      if (m.state[k] != ScanMatch::counts) continue;
      const double d = m.distance[i], w = area_[i] * std::exp(-d * d / (2 * 9 * spread * spread));
      weight[i] += w;
      pull.row(i) = w * (result_.V.row(i) - d * scan_.N.row(m.point[k]) - start_.row(i));
    }
    Sparse A = plate_;
    A.diagonal() += weight;
    if (result_.summary.iterations == 0) solver_.analyzePattern(A);
    solver_.factorize(A);
    if (solver_.info() != Eigen::Success)
      throw SolverError("refinement: the system cannot be solved; use a larger fading");
    result_.offsets = solver_.solve(Eigen::MatrixXd(pull));
    result_.V = start_ + result_.offsets;
  }

  void report(ScanMatches m) {
    std::vector<double> size;
    for (size_t k = 0; k < m.state.size(); ++k)
      if (m.state[k] == ScanMatch::counts) size.push_back(std::abs(m.distance[static_cast<Eigen::Index>(k)]));
    RefineSummary& s = result_.summary;
    s.matched = static_cast<int>(size.size());
    s.median_mm = size.empty() ? 0 : median_of(size);
    s.mean_offset = result_.offsets.rowwise().norm().mean();
    result_.distances = std::move(m.distance);
    result_.matches = std::move(m.state);
  }

  const Faces& faces_;
  const Vertices& start_;
  RefineOptions options_;
  ScanSurface scan_;
  Eigen::VectorXd area_;
  Sparse plate_;
  Eigen::SimplicialLDLT<Sparse> solver_;
  RefinedFace result_;
};

}  // namespace

RefinedFace refine_to_scan(const MorphableModel& model, const Mesh& scan, const FitScanResult& fit,
                           const RefineOptions& options) {
  check(options);
  return Refinement(model, scan, fit, options).run();
}

}  // namespace facewright
