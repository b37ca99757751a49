// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/appearance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/core/median.h"
#include "libmodel/geometry/laplacian.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

constexpr double kLongestEdge = 2;  // mm
constexpr double kMeanLength = 15;  // mm: wider than brows and lips, narrower than a cheek's flush
constexpr double kDarkest = 0.005;  // linear: below it a camera sees noise
constexpr double kBrightest = 1.5;  // relative to the skin: highlights say nothing
constexpr double kStrongest = 1.5;  // natural logarithms, either way

// Luminance, log(R/B), log(R/G) of one colour.
Eigen::RowVector3d raw_feature(const Eigen::RowVector3d& c) {
  return {0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2], std::log((c[0] + kDarkest) / (c[2] + kDarkest)),
          std::log((c[0] + kDarkest) / (c[1] + kDarkest))};
}

}  // namespace

AppearanceSpace::AppearanceSpace(const MultiresTemplate& reference) {
  const int levels = static_cast<int>(reference.levels.size());
  if (levels == 0) throw InvalidInput("appearance: the reference has no levels");
  while (level_ + 1 < levels) {
    const Mesh mesh = reference.level_mesh(level_);
    if (mean_edge_length(mesh.V, mesh.F) <= kLongestEdge) break;
    ++level_;
  }
  vertex_count_ = reference.levels[static_cast<size_t>(level_)].vertex_count;
  const Mesh coarse = reference.level_mesh(std::max(0, level_ - 1));
  mean_count_ = static_cast<int>(coarse.V.rows());
  base_count_ = reference.base_count();
  parents_.assign(reference.parents.begin(), reference.parents.begin() + (vertex_count_ - base_count_));
  areas_ = vertex_areas(coarse.V, coarse.F);
  Eigen::SparseMatrix<double> A = kMeanLength * kMeanLength * cotangent_stiffness(coarse.V, coarse.F);
  for (Eigen::Index i = 0; i < areas_.size(); ++i) A.coeffRef(i, i) += areas_[i];
  auto smoother = std::make_shared<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>>(A);
  if (smoother->info() != Eigen::Success) throw SolverError("appearance: the means could not be factorised");
  smoother_ = std::move(smoother);
}

AppearanceFeatures AppearanceSpace::features(const AppearanceSample& sample) const {
  if (sample.colours.rows() != vertex_count_ || static_cast<int>(sample.seen.size()) != vertex_count_)
    throw InvalidInput("appearance: " + std::to_string(sample.colours.rows()) + " colours for " +
                       std::to_string(vertex_count_) + " vertices");
  AppearanceFeatures f = AppearanceFeatures::Zero(vertex_count_, kAppearanceFeatures);
  std::vector<double> channel[kAppearanceFeatures];
  for (int i = 0; i < vertex_count_; ++i) {
    if (!sample.seen[static_cast<size_t>(i)]) continue;
    f.row(i) = raw_feature(sample.colours.row(i));
    if (i < mean_count_)
      for (int c = 0; c < kAppearanceFeatures; ++c) channel[c].push_back(f(i, c));
  }
  const double skin = std::max(median_of(channel[0]), kDarkest);
  const double tone[2] = {median_of(channel[1]), median_of(channel[2])};
  for (int i = 0; i < vertex_count_; ++i) {
    if (!sample.seen[static_cast<size_t>(i)]) continue;  // stays at the skin's own values
    f(i, 0) = std::min(f(i, 0) / skin, kBrightest) - 1;
    for (int c = 0; c < 2; ++c) f(i, 1 + c) = std::clamp(f(i, 1 + c) - tone[c], -kStrongest, kStrongest);
  }
  const Eigen::MatrixXd mean = smoother_->solve(areas_.asDiagonal() * f.topRows(mean_count_));
  return f - refine_field(parents_, base_count_, mean, vertex_count_);
}

FaceAppearance learn_appearance(const std::vector<AppearanceFeatures>& features,
                                const std::vector<std::vector<bool>>& seen) {
  FaceAppearance a;
  if (features.size() < 3) return a;
  const Eigen::Index n = features.front().rows();
  a.mean = AppearanceFeatures::Zero(n, kAppearanceFeatures);
  a.deviation = AppearanceFeatures::Constant(n, kAppearanceFeatures, std::numeric_limits<double>::infinity());
  std::vector<double> x;
  for (Eigen::Index i = 0; i < n; ++i)
    for (int c = 0; c < kAppearanceFeatures; ++c) {
      x.clear();
      for (size_t s = 0; s < features.size(); ++s)
        if (seen[s][static_cast<size_t>(i)]) x.push_back(features[s](i, c));
      if (x.size() < 3) continue;
      a.mean(i, c) = median_of(x);
      double sum = 0;
      for (const double v : x) sum += (v - a.mean(i, c)) * (v - a.mean(i, c));
      a.deviation(i, c) = std::sqrt(sum / static_cast<double>(x.size()));
    }
  return a;
}

}  // namespace facewright
