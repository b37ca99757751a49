// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/expressions.h"

#include <algorithm>
#include <set>

#include "libmodel/core/errors.h"
#include "libmodel/core/median.h"
#include "libmodel/core/parallel.h"
#include "libmodel/core/similarity.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

constexpr double kElsewhere = 0.05;  // start weight outside the upper face, which moves least

Eigen::VectorXd start_weights(const MultiresTemplate& reference) {
  const Eigen::VectorXd area = vertex_areas(reference.V, reference.levels.back().F);
  Eigen::VectorXd weights = kElsewhere * area;
  bool any = false;
  for (const char* region : {"forehead", "nose"})
    if (const auto entry = reference.regions.find(region); entry != reference.regions.end())
      for (const int v : entry->second) weights[v] = area[v], any = true;
  return any ? weights : area;
}

void check(const RegisteredSet& scans, const std::vector<ExpressionLabel>& labels, const MultiresTemplate& reference,
           const Vertices& mean, const ExpressionBuildOptions& options) {
  const auto expect = [](bool ok, const std::string& what) {
    if (!ok) throw InvalidInput("expressions: " + what);
  };
  expect(static_cast<Eigen::Index>(labels.size()) == scans.scan_count(),
         std::to_string(labels.size()) + " labels for " + std::to_string(scans.scan_count()) + " scans");
  expect(scans.scan_count() == 0 || scans.vertex_count() == reference.V.rows(),
         "the scans do not have the template's number of vertices");
  expect(mean.rows() == reference.V.rows(), "the mean does not have the template's number of vertices");
  expect(scans.shapes.allFinite(), "a scan holds NaN or infinity");
  expect(options.still_mm > 0 && options.max_iterations > 0, "still_mm and max_iterations must be positive");
}

std::vector<int> usable_scans(const std::vector<ExpressionLabel>& labels, ExpressionSummary* summary) {
  std::set<std::string> known, without;
  for (const ExpressionLabel& l : labels)
    if (l.expression.empty()) known.insert(l.subject);
  std::vector<int> usable;
  for (size_t s = 0; s < labels.size(); ++s) {
    if (labels[s].expression.empty()) continue;
    if (known.count(labels[s].subject))
      usable.push_back(static_cast<int>(s));
    else
      without.insert(labels[s].subject);
  }
  summary->without_neutral.assign(without.begin(), without.end());
  return usable;
}

// A person's neutral face in the model's frame: the mean of their neutral scans, each laid on the first.
std::map<std::string, Vertices> neutral_faces(const RegisteredSet& scans, const std::vector<ExpressionLabel>& labels,
                                              const Vertices& mean, const Eigen::VectorXd& weights,
                                              const ExpressionBuildOptions& options) {
  std::map<std::string, Vertices> first, sum;
  std::map<std::string, int> count;
  for (size_t s = 0; s < labels.size(); ++s) {
    if (!labels[s].expression.empty()) continue;
    const Vertices face = scans.vertices(static_cast<Eigen::Index>(s));
    const std::string& who = labels[s].subject;
    if (!first.count(who)) {
      first[who] = sum[who] = fit_similarity(face, mean, weights, Scaling::fixed).apply(face);
    } else {
      sum[who] += align_still_parts(face, first[who], weights, options.still_mm, options.max_iterations).apply(face);
    }
    ++count[who];
  }
  for (auto& [who, total] : sum) total /= count[who];
  return sum;
}

// Everybody's mean displacement by expression, then the mean over people.
std::vector<Blendshape> blendshapes_of(const SampleMatrix& displacements, const std::vector<int>& usable,
                                       const std::vector<ExpressionLabel>& labels) {
  std::map<std::string, std::map<std::string, std::pair<Eigen::VectorXd, int>>> sums;  // expression, subject
  for (size_t i = 0; i < usable.size(); ++i) {
    const ExpressionLabel& l = labels[static_cast<size_t>(usable[i])];
    auto& [sum, count] = sums[l.expression][l.subject];
    if (count++ == 0) sum = Eigen::VectorXd::Zero(displacements.cols());
    sum += displacements.row(static_cast<Eigen::Index>(i)).transpose();
  }
  std::vector<Blendshape> result;
  for (const auto& [name, people] : sums) {
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(displacements.cols());
    for (const auto& [who, entry] : people) mean += entry.first / entry.second;
    result.push_back({name, mean / static_cast<double>(people.size())});
  }
  return result;
}

}  // namespace

Similarity align_still_parts(const Vertices& A, const Vertices& B, const Eigen::VectorXd& weights, double scale,
                             int iterations) {
  Similarity motion = fit_similarity(A, B, weights, Scaling::fixed);
  double current = -1;
  for (int i = 0; i < iterations; ++i) {
    const Eigen::VectorXd distance = (motion.apply(A) - B).rowwise().norm();
    std::vector<double> sorted(distance.begin(), distance.end());
    if (current < 0) current = std::max(scale, median_of(sorted));
    const Eigen::ArrayXd damping = 1 + (distance.array() / current).square();
    const Similarity next = fit_similarity(A, B, (weights.array() / damping.square()).matrix(), Scaling::fixed);
    const double moved = (next.R - motion.R).norm() * 100 + (next.t - motion.t).norm();  // at 100 mm, about a head
    motion = next;
    if (current == scale && moved < 1e-9) break;
    current = std::max(scale, current * 0.7);
  }
  return motion;
}

ExpressionResult build_expressions(const RegisteredSet& scans, const std::vector<ExpressionLabel>& labels,
                                   const MultiresTemplate& reference, const Vertices& mean,
                                   const ExpressionBuildOptions& options) {
  check(scans, labels, reference, mean, options);
  ExpressionResult result;
  ExpressionSummary& summary = result.summary;
  summary.options = options;
  const std::vector<int> usable = usable_scans(labels, &summary);
  summary.scans = static_cast<int>(usable.size());
  if (usable.empty()) return result;
  const Eigen::VectorXd weights = start_weights(reference);
  const std::map<std::string, Vertices> neutral = neutral_faces(scans, labels, mean, weights, options);
  SampleMatrix displacements(static_cast<Eigen::Index>(usable.size()), scans.shapes.cols());
  parallel_for(static_cast<int>(usable.size()), options.threads, [&](int i) {
    const int s = usable[static_cast<size_t>(i)];
    const Vertices face = scans.vertices(s), &rest = neutral.at(labels[static_cast<size_t>(s)].subject);
    const Vertices moved =
        align_still_parts(face, rest, weights, options.still_mm, options.max_iterations).apply(face) - rest;
    displacements.row(i) = Eigen::Map<const Eigen::RowVectorXd>(moved.data(), moved.size());
  });
  result.blendshapes = blendshapes_of(displacements, usable, labels);
  std::set<std::string> people;
  for (const int s : usable) {
    people.insert(labels[static_cast<size_t>(s)].subject);
    ++summary.scans_of[labels[static_cast<size_t>(s)].expression];
  }
  summary.subjects = static_cast<int>(people.size());
  for (const Blendshape& b : result.blendshapes)
    summary.rms_mm[b.name] = std::sqrt(b.displacement.squaredNorm() / static_cast<double>(reference.V.rows()));
  PcaResult pca = fit_pca(displacements, {.variance_share = options.variance_share, .threads = options.threads});
  summary.pca = pca.summary;
  result.expression = std::move(pca.model);
  return result;
}

}  // namespace facewright
