// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/coarse_pose.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/geometry/normals.h"
#include "libregister/landmarking/mirror_plane.h"
#include "libregister/landmarking/pose_sweep.h"

namespace facewright {
namespace {

// One round of iterated closest points; weights fall with distance, and where normals disagree.
struct Fit {
  Vertices nearest;
  Eigen::VectorXd weights;
  double score = 0;
};

Fit match(const Similarity& S, const Vertices& V, const Vertices& normals, const PoseTarget& target, double width) {
  Fit fit;
  const Vertices moved = S.apply(V);
  const std::vector<int> near = target.index.nearest(moved);
  fit.nearest.resize(V.rows(), 3);
  fit.weights.resize(V.rows());
  for (Eigen::Index i = 0; i < V.rows(); ++i) {
    const int j = near[static_cast<size_t>(i)];
    fit.nearest.row(i) = target.mesh.V.row(j);
    const double d = (fit.nearest.row(i) - moved.row(i)).norm() / S.s;
    const double facing = target.normals.row(j).dot((S.R * normals.row(i).transpose()).transpose());
    fit.weights[i] = std::exp(-0.5 * d * d / (width * width)) * std::max(0.0, facing);
  }
  fit.score = fit.weights.mean();
  return fit;
}

CoarsePose refine(Similarity S, const Vertices& V, const Vertices& normals, const PoseTarget& target, int iterations,
                  double first_width, const CoarsePoseOptions& options) {
  constexpr double kLastWidth = 4;  // mm: faces differ by so much about a similarity
  for (int i = 0; i < iterations; ++i) {
    const double width = first_width * std::pow(kLastWidth / first_width, static_cast<double>(i) / iterations);
    const Fit fit = match(S, V, normals, target, width);
    if ((fit.weights.array() > 1e-3).count() < 12) break;
    try {
      Similarity next = fit_similarity(V, fit.nearest, fit.weights);
      if (next.s < options.lowest_scale || next.s > options.highest_scale) {
        const double s = std::clamp(next.s, options.lowest_scale, options.highest_scale);
        next = fit_similarity(V * s, fit.nearest, fit.weights, Scaling::fixed);
        next.s = s;
      }
      S = next;
    } catch (const InvalidInput&) {
      break;
    }
  }
  return {S, match(S, V, normals, target, kLastWidth).score};
}

Similarity pose_from(const FacePattern& pattern, const Dome& dome, const Eigen::Vector3d& up, double angle) {
  const auto frame = [](const Eigen::Vector3d& axis, const Eigen::Vector3d& direction) {
    Eigen::Matrix3d R;
    R << direction.cross(axis), direction, axis;
    return R;
  };
  // Sectors go on counter-clockwise from up, seen from outside.
  const Eigen::Vector3d turned = Eigen::AngleAxisd(angle, dome.axis) * up;
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d pattern_up = (y - y.dot(pattern.nose.axis) * pattern.nose.axis).normalized();
  Similarity S;
  S.R = frame(dome.axis, turned) * frame(pattern.nose.axis, pattern_up).transpose();
  S.t = dome.tip - S.R * pattern.nose.tip;
  return S;
}

bool alike(const CoarsePose& a, const CoarsePose& b) {
  const Similarity d = a.scan_from_head.inverse() * b.scan_from_head;
  return Eigen::AngleAxisd(d.R).angle() < 0.35 && d.t.norm() < 30;
}

void sort_best_first(std::vector<CoarsePose>* poses) {
  std::stable_sort(poses->begin(), poses->end(),
                   [](const CoarsePose& a, const CoarsePose& b) { return a.score > b.score; });
}

Vertices every(const Vertices& X, int step) {
  Vertices kept((X.rows() + step - 1) / step, 3);
  for (Eigen::Index i = 0; i < kept.rows(); ++i) kept.row(i) = X.row(i * step);
  return kept;
}

}  // namespace

PoseTarget::PoseTarget(Mesh surface, Vertices vertex_normals)
    : mesh(std::move(surface)), normals(std::move(vertex_normals)), index(mesh.V) {}

FacePattern face_pattern(const Mesh& fine, const Mesh& coarse, const Eigen::Vector3d& nose_tip) {
  FacePattern pattern;
  pattern.V = coarse.V;
  pattern.normals = vertex_normals(coarse.V, coarse.F);
  const Vertices normals = vertex_normals(fine.V, fine.F);
  double nearest = 20;
  for (const Dome& dome : find_domes(fine, normals, 20))
    if (const double d = (dome.tip - nose_tip).norm(); d < nearest) nearest = d, pattern.nose = dome;
  if (nearest >= 20) throw InvalidInput("landmarking: the reference face has no nose near its landmark 31");
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY(), axis = pattern.nose.axis;
  pattern.depth = polar_depth(fine, normals, pattern.nose, (y - y.dot(axis) * axis).normalized());
  return pattern;
}

std::vector<CoarsePose> find_coarse_poses(const FacePattern& pattern, const PoseTarget& target,
                                          const CoarsePoseOptions& options) {
  const Vertices V = every(pattern.V, 4), normals = every(pattern.normals, 4);
  struct Start {
    Similarity S;
    double mismatch;
  };
  std::vector<Start> starts;
  for (const Dome& dome : find_domes(target.mesh, target.normals, options.domes)) {
    const Eigen::Vector3d up = dome.axis.unitOrthogonal();
    for (const Turn& turn : best_turns(pattern.depth, polar_depth(target.mesh, target.normals, dome, up), 2))
      starts.push_back({pose_from(pattern, dome, up, turn.angle), turn.mismatch});
  }
  std::stable_sort(starts.begin(), starts.end(),
                   [](const Start& a, const Start& b) { return a.mismatch < b.mismatch; });
  if (static_cast<int>(starts.size()) > options.starts) starts.resize(static_cast<size_t>(options.starts));
  std::vector<CoarsePose> poses;
  for (const Start& start : starts) poses.push_back(refine(start.S, V, normals, target, 12, 12, options));
  // The best that differ, laid on with all points.
  const auto best = [&] {
    sort_best_first(&poses);
    std::vector<CoarsePose> kept;
    for (const CoarsePose& pose : poses) {
      if (kept.size() == 4) break;
      if (std::any_of(kept.begin(), kept.end(), [&](const CoarsePose& k) { return alike(k, pose); })) continue;
      kept.push_back(refine(pose.scan_from_head, pattern.V, pattern.normals, target, 20, 8, options));
    }
    sort_best_first(&kept);
    return kept;
  };
  const std::vector<CoarsePose> kept = best();
  if (!kept.empty() && kept[0].score >= options.sure) return kept;
  // No nose to begin with: it is a hole, or hidden.
  for (const Eigen::Matrix3d& axes : {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), principal_axes(target.mesh.V)})
    for (const Eigen::Matrix3d& turn : cube_rotations())
      for (const Similarity& S : swept_poses(target.mesh.V, target.normals, axes * turn, pattern.nose.tip))
        poses.push_back(refine(S, V, normals, target, 8, 16, options));
  return best();
}

CoarsePose straighten(const CoarsePose& pose, const FacePattern& pattern, const PoseTarget& target) {
  const Similarity& S = pose.scan_from_head;
  const Similarity head_from_scan = S.inverse();
  const Eigen::RowVector3d low = pattern.V.colwise().minCoeff(), high = pattern.V.colwise().maxCoeff();
  std::vector<int> sample;
  for (Eigen::Index i = 0; i < target.mesh.V.rows(); ++i) {
    const Eigen::Vector3d x = head_from_scan * target.mesh.V.row(i).transpose();
    if ((x.transpose().array() > low.array() - 10).all() && (x.transpose().array() < high.array() + 10).all())
      sample.push_back(static_cast<int>(i));
  }
  constexpr size_t kEnough = 2000;  // points
  const size_t step = sample.size() / kEnough + 1;
  for (size_t i = 0; i * step < sample.size(); ++i) sample[i] = sample[i * step];
  sample.resize((sample.size() + step - 1) / step);
  MirrorPlane guess;
  guess.normal = S.R.col(0);
  guess.offset = guess.normal.dot(S.t);
  const MirrorPlane plane = refine_mirror_plane(guess, target.mesh.V, target.normals, target.index, sample);
  constexpr double kFarthestTurn = 0.26, kFarthestShift = 15;  // radians, mm: beyond them it is another symmetry
  const Eigen::Vector3d middle = S * pattern.nose.tip;
  const double shift = plane.normal.dot(middle) - plane.offset;
  if (plane.normal.dot(guess.normal) < std::cos(kFarthestTurn) || std::abs(shift) > kFarthestShift) return pose;
  CoarsePose straight = pose;
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(guess.normal, plane.normal);
  straight.scan_from_head.R = turn.toRotationMatrix() * S.R;
  straight.scan_from_head.t = middle - S.s * (straight.scan_from_head.R * pattern.nose.tip) - shift * plane.normal;
  return straight;
}

}  // namespace facewright
