// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/face_alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace facewright {
namespace {

constexpr double kReachFirst = 40, kReachLast = 20;  // mm: farther partners do not count
constexpr double kReachSeen = 12;                    // mm: a point of the face without surface so near is not seen
constexpr double kAlong = 0.05;           // weight of distances along the surface: keeps the face from sliding
constexpr double kScaleDeviation = 0.1;   // of people's faces about the reference: 4 % in adults, children are smaller
constexpr double kShapeDeviation = 0.05;  // of width, height and depth about their mean
constexpr double kNoise = 2.5;            // mm: how far one face is from another after that
constexpr double kTogether = 30;          // points that err together: neighbours in a face differ alike
constexpr double kWorst = 8;              // mm: the most a point counts in the misfit
constexpr double kLargestTurn = 0.2;      // radians, per iteration

using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;

// x -> R (sides * (x - c)) + t, c the face's middle.
struct Pose {
  Eigen::Matrix3d R;
  Eigen::Vector3d log_sides, t;
  Eigen::RowVector3d c;

  Eigen::Vector3d sides() const { return log_sides.array().exp(); }
  Vertices apply(const Vertices& X) const {
    const Eigen::Matrix3d A = R * sides().asDiagonal();
    return (((X.rowwise() - c) * A.transpose()).rowwise() + t.transpose()).eval();
  }
};

double tukey(double r, double reach) {
  const double q = 1 - r * r / (reach * reach);
  return q > 0 ? q * q : 0;
}

// The prior of the sides' logarithms: their mean about 0, each about the mean.
void add_prior(const Pose& pose, Matrix9& A, Vector9& b) {
  const Eigen::Matrix3d mean = Eigen::Matrix3d::Constant(1.0 / 3);
  const Eigen::Matrix3d P = kTogether * kNoise * kNoise *
                            (mean / (kScaleDeviation * kScaleDeviation) +
                             (Eigen::Matrix3d::Identity() - mean) / (kShapeDeviation * kShapeDeviation));
  A.bottomRightCorner<3, 3>() += P;
  b.tail<3>() -= P * pose.log_sides;
}

Pose improve(const FacePoints& face, const SurfaceSample& scan, const PointIndex& index, const Pose& pose,
             double reach) {
  const Vertices Y = pose.apply(face.sample.P);
  const std::vector<int> nearest = index.nearest(Y);
  Matrix9 A = Matrix9::Zero();
  Vector9 b = Vector9::Zero();
  int count = 0;
  for (Eigen::Index i = 0; i < Y.rows(); ++i) {
    const Eigen::Vector3d y = Y.row(i), d = y - scan.P.row(nearest[static_cast<size_t>(i)]).transpose();
    const double w = tukey(d.norm(), reach);
    if (w == 0) continue;
    ++count;
    const Eigen::Vector3d n = pose.R * face.sample.N.row(i).transpose(), r = y - pose.t;
    const Eigen::Vector3d local = pose.R.transpose() * r;
    const auto add = [&](const Eigen::Vector3d& direction, double residual, double weight) {
      Vector9 J;
      J << r.cross(direction), direction, local.cwiseProduct(pose.R.transpose() * direction);
      A += weight * J * J.transpose(), b -= weight * residual * J;
    };
    add(n, n.dot(d), w);
    for (int k = 0; k < 3; ++k) add(Eigen::Vector3d::Unit(k), d[k], kAlong * w);
  }
  if (count < 12) return pose;
  add_prior(pose, A, b);
  const Vector9 x = A.ldlt().solve(b);
  Eigen::Vector3d turn = x.head<3>();
  if (turn.norm() > kLargestTurn) turn *= kLargestTurn / turn.norm();
  Pose next = pose;
  if (turn.norm() > 0) next.R = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * pose.R;
  next.t += x.segment<3>(3);
  next.log_sides += x.tail<3>().cwiseMin(0.1).cwiseMax(-0.1);
  return next;
}

// Depths of the scan in the face's own frame: mean of the samples in each cell that lie near the face's depth.
class ScanDepths {
 public:
  ScanDepths(const Vertices& X, const std::vector<bool>& use) {
    for (Eigen::Index i = 0; i < X.rows(); ++i)
      if (use[static_cast<size_t>(i)]) bins_[key(X(i, 0), X(i, 1))].push_back(X(i, 2));
  }
  std::optional<double> at(const Eigen::Vector3d& x) const {
    const auto bin = bins_.find(key(x[0], x[1]));
    if (bin == bins_.end()) return {};
    double sum = 0;
    int n = 0;
    for (const double z : bin->second)
      if (std::abs(z - x[2]) < kReachDepth) sum += z, ++n;
    return n > 0 ? std::optional<double>(sum / n) : std::nullopt;
  }

 private:
  static constexpr double kCell = 6, kReachDepth = 25;  // mm
  static std::pair<int, int> key(double x, double y) {
    return {static_cast<int>(std::floor(x / kCell)), static_cast<int>(std::floor(y / kCell))};
  }
  std::map<std::pair<int, int>, std::vector<double>> bins_;
};

// How well the relief agrees beyond what any convex thing has: eyes, nose and mouth.
double relief_correlation(const FacePoints& face, const SurfaceSample& scan, const Pose& pose) {
  const Eigen::Matrix3d inverse = pose.sides().cwiseInverse().asDiagonal() * pose.R.transpose();
  const Vertices X = ((scan.P.rowwise() - pose.t.transpose()) * inverse.transpose()).rowwise() + pose.c;
  std::vector<bool> near_face(static_cast<size_t>(X.rows()));
  for (Eigen::Index i = 0; i < X.rows(); ++i) near_face[static_cast<size_t>(i)] = X.row(i).cwiseAbs().maxCoeff() < 140;
  const ScanDepths depths(X, near_face);
  std::vector<std::array<double, 4>> rows;  // x, y, depth of the face, depth of the scan
  for (Eigen::Index i = 0; i < face.sample.P.rows(); ++i) {
    const Eigen::Vector3d x = face.sample.P.row(i);
    if (!face.inner[static_cast<size_t>(i)] || face.sample.N(i, 2) < 0.3) continue;
    if (const auto z = depths.at(x)) rows.push_back({(x[0] - pose.c[0]) / 50, (x[1] - pose.c[1]) / 50, x[2], *z});
  }
  if (rows.size() < 30) return 0;
  Eigen::MatrixXd A(static_cast<Eigen::Index>(rows.size()), 6), Z(A.rows(), 2);
  for (Eigen::Index i = 0; i < A.rows(); ++i) {
    const auto& [x, y, face_depth, scan_depth] = rows[static_cast<size_t>(i)];
    A.row(i) << 1, x, y, x * x, x * y, y * y;
    Z.row(i) << face_depth, scan_depth;
  }
  const Eigen::MatrixXd rest = Z - A * (A.transpose() * A).ldlt().solve(A.transpose() * Z);
  const double product = rest.col(0).norm() * rest.col(1).norm();
  return product > 0 ? rest.col(0).dot(rest.col(1)) / product : 0;
}

}  // namespace

FaceAlignment align_face(const FacePoints& face, const SurfaceSample& scan, const PointIndex& index,
                         const Similarity& scan_from_face, int iterations) {
  FaceAlignment result;
  const Eigen::Vector3d c = face.sample.P.colwise().mean();
  Pose pose{scan_from_face.R, Eigen::Vector3d::Constant(std::log(scan_from_face.s)), scan_from_face * c, c.transpose()};
  for (int i = 0; i < iterations; ++i) {
    const double left = std::max(0.0, 1 - 1.5 * i / iterations);
    pose = improve(face, scan, index, pose, kReachLast + (kReachFirst - kReachLast) * left);
  }
  result.sides = pose.sides();
  result.scan_from_face.R = pose.R;
  result.scan_from_face.s = std::exp(pose.log_sides.mean());
  result.scan_from_face.t = pose.t - result.scan_from_face.s * (pose.R * c);
  const Vertices Y = pose.apply(face.sample.P);
  const std::vector<int> nearest = index.nearest(Y);
  double sum = 0, bend = 0;
  int count = 0, covered = 0;
  for (Eigen::Index i = 0; i < Y.rows(); ++i) {
    const int p = nearest[static_cast<size_t>(i)];
    const Eigen::Vector3d d = Y.row(i) - scan.P.row(p), n = pose.R * face.sample.N.row(i).transpose();
    const bool has_partner = d.norm() < kReachSeen;
    result.partner.push_back(has_partner ? p : -1);
    result.normal.push_back(n);
    if (!face.inner[static_cast<size_t>(i)]) continue;
    sum += has_partner ? std::min(std::abs(n.dot(d)), kWorst) : kWorst;
    bend += has_partner ? 1 - std::abs(n.dot(scan.N.row(p))) : 0.5;
    ++count, covered += has_partner;
  }
  result.relief = relief_correlation(face, scan, pose);
  result.misfit = count > 0 ? sum / count : kWorst;
  result.bend = count > 0 ? bend / count : 1;
  result.cover = count > 0 ? static_cast<double>(covered) / count : 0;
  return result;
}

}  // namespace facewright
