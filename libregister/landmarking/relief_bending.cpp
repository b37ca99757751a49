// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/relief_bending.h"

#include <cmath>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

#include "libmodel/core/errors.h"
#include "libregister/landmarking/landmark_checks.h"
#include "libregister/landmarking/relief_landmarks.h"
#include "libregister/landmarking/relief_pose.h"
#include "libregister/landmarking/view_landmarks.h"

namespace facewright {

// What relief is compared in, and how far.
struct ReliefBending::Round {
  PatchMatchOptions match;
  ReliefOptions relief;
};

// Parts of a face, then features: what is wide has fewer likenesses nearby.
const ReliefBending::Round ReliefBending::kRounds[] = {
    {{.patch = 16, .reach = 10}, {.fine = 3, .broad = 20, .highest = 15}},
    {{.patch = 12, .reach = 10}, {.fine = 2, .broad = 10, .highest = 5}},
    {{.reach = 6}, {}},
    {{.reach = 4}, {}}};

namespace {

constexpr double kRadians = std::numbers::pi / 180;
constexpr size_t kNearRound = 2;
constexpr double kFloor = 1.0;  // mm: what all views get wrong alike

// What faces differ by, and how much a difference of one deviation counts beside correlations: chosen on simulated
// scans (docs/landmarking.md). One that lies a feature too low or high is stretched: 1.15 times as large and more.
constexpr double kSizeDeviation = 0.1, kShapeDeviation = 0.12;  // of ln(size), of ln(height / width)
constexpr double kSizePenalty = 0.1, kShapePenalty = 0.06;
constexpr double kUncertain = 6;  // mm: what a landmark's mean deviation costs as much as a correlation of one

bool is_inner(const std::string& name) {
  return name.find_first_not_of("0123456789") == std::string::npos && !is_jaw_landmark(name);
}

// Of eyes, nose and mouth over the reference's: as a whole, along x, along y.
struct Proportions {
  double size = 1, width = 1, height = 1;
};
Proportions proportions(const Landmarks& marks, const Landmarks& found) {
  std::vector<Eigen::Vector3d> from, to;
  for (const auto& [name, mark] : marks) {
    const auto it = found.find(name);
    if (!is_inner(name) || it == found.end()) continue;
    from.push_back(mark.position);
    to.push_back(it->second.position);
  }
  const auto n = static_cast<Eigen::Index>(from.size());
  if (n < 3) throw InvalidInput("landmarking: too few landmarks to tell a face's proportions");
  Vertices A = Eigen::Map<const Vertices>(from[0].data(), n, 3), B = Eigen::Map<const Vertices>(to[0].data(), n, 3);
  const Similarity S = fit_similarity(A, B);
  A.rowwise() -= A.colwise().mean().eval();
  B.rowwise() -= B.colwise().mean().eval();
  const Vertices back = B * S.R;
  return {S.s, A.col(0).dot(back.col(0)) / A.col(0).squaredNorm(), A.col(1).dot(back.col(1)) / A.col(1).squaredNorm()};
}

}  // namespace

ReliefBending::ReliefBending(const Mesh& scan, const Mesh& fine, const MultiresTemplate& coarse, const Landmarks& marks,
                             const FaceViewOptions& view)
    : scan_(scan), fine_(fine), coarse_(coarse), marks_(marks), view_(view) {}

Landmarks ReliefBending::marks_on(const BentTemplate& bent) const {
  return locate(coarse_.landmarks, bent.V.topRows(coarse_.base_count()), coarse_.levels[0].F);
}

Landmarks ReliefBending::compare(const BentTemplate& bent, const Round& round, int* views) const {
  const BentReference reference{{bent.V, fine_.F, {}, {}, {}}, marks_on(bent)};
  FaceViewOptions millimetres = view_;
  millimetres.size = static_cast<int>(view_.field);
  std::vector<ViewAngle> angles;
  for (const double yaw : {0.0, -25.0, 25.0, -50.0, 50.0}) angles.push_back({yaw * kRadians, 0});
  angles.push_back({0, -25 * kRadians});  // chin and jaw from below
  *views = static_cast<int>(angles.size());
  return fuse_views(
      relief_landmarks(scan_, reference, bent.scan_from_head, angles, millimetres, round.match, round.relief), kFloor);
}

ReliefStart ReliefBending::bend(const BentTemplate& straight) const {
  ReliefStart result{straight, -1};
  try {
    int views = 0;
    const Landmarks found = compare(straight, kRounds[0], &views);
    result.bent = bend_template(fine_.V, coarse_, found);
    const Proportions p = proportions(marks_, marks_on(result.bent));
    result.likeness = relief_likeness(scan_, {result.bent.V, fine_.F, {}, {}, {}}, result.bent.scan_from_head, view_);
    double deviations = 0, count = 0;
    for (const auto& [name, mark] : found)
      if (!is_jaw_landmark(name)) deviations += mark.stddev, ++count;
    const double size = std::log(p.size) / kSizeDeviation, shape = std::log(p.height / p.width) / kShapeDeviation;
    result.merit = result.likeness - deviations / std::max(1.0, count) / kUncertain - kSizePenalty * size * size -
                   kShapePenalty * shape * shape;
  } catch (const InvalidInput&) {  // no face's landmarks
  }
  return result;
}

ReliefStart ReliefBending::start(const Similarity& scan_from_head) const {
  const ReliefStart own = bend({scan_from_head.apply(fine_.V), scan_from_head});
  const ReliefPose whole = lay_by_relief(scan_, fine_, scan_from_head, view_);
  const ReliefStart laid = bend({whole.V, whole.scan_from_head});
  return own.merit > laid.merit ? own : laid;
}

Landmarks ReliefBending::finish(const ReliefStart& start, int* views) const {
  BentTemplate bent = start.bent;
  Landmarks found;
  for (size_t i = 1; i < std::size(kRounds); ++i) {
    found = compare(bent, kRounds[i], views);
    if (i + 1 < std::size(kRounds)) bent = bend_template(fine_.V, coarse_, found);
  }
  return found;
}

Landmarks ReliefBending::refine(const BentTemplate& bent, int* views) const {
  return compare(bent, kRounds[kNearRound], views);
}

}  // namespace facewright
