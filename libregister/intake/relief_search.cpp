// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/relief_search.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

constexpr float kNothing = -std::numeric_limits<float>::infinity();
constexpr double kLeastCover = 0.6;     // of the face's cells; a scan may end at the hairline or the cheeks
constexpr double kMissingDepth = 12.0;  // mm: what a cell without surface counts as
constexpr int kRolls = 12;
constexpr int kPolished = 48;
constexpr double kMostCells = 1 << 24;  // some 20 m to either side; farther points are damage
constexpr double kDeepest = 140;        // mm: what lies farther behind the face's middle is background

// Directions of an icosahedron's corners: 12, any other is within 38 degrees of one. What is found is polished.
std::vector<Eigen::Vector3d> view_directions() {
  const double g = std::numbers::phi;
  std::vector<Eigen::Vector3d> list;
  for (const double s : {-1.0, 1.0})
    for (const double t : {-g, g})
      for (int k = 0; k < 3; ++k) {
        Eigen::Vector3d d = Eigen::Vector3d::Zero();
        d[(k + 1) % 3] = s, d[(k + 2) % 3] = t;
        list.push_back(d.normalized());
      }
  return list;
}

// Rotations that turn the view direction to +z, `rolls` of each.
std::vector<Eigen::Matrix3d> view_rotations(int rolls) {
  std::vector<Eigen::Matrix3d> list;
  for (const Eigen::Vector3d& d : view_directions()) {
    const Eigen::Matrix3d base = Eigen::Quaterniond::FromTwoVectors(d, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    for (int k = 0; k < rolls; ++k)
      list.push_back(Eigen::AngleAxisd(2 * std::numbers::pi * k / rolls, Eigen::Vector3d::UnitZ()) * base);
  }
  return list;
}

struct DepthMap {
  int columns = 0, rows = 0;
  double left = 0, bottom = 0;
  std::vector<float> depth;
};

DepthMap depth_map(const Eigen::Matrix3d& R, const Vertices& points, double cell) {
  const Vertices X = points * R.transpose();
  DepthMap map;
  map.left = X.col(0).minCoeff(), map.bottom = X.col(1).minCoeff();
  const double columns = (X.col(0).maxCoeff() - map.left) / cell, rows = (X.col(1).maxCoeff() - map.bottom) / cell;
  if (!((columns + 1) * (rows + 1) < kMostCells)) return map;  // no cell: nothing is found on it
  map.columns = 1 + static_cast<int>(columns), map.rows = 1 + static_cast<int>(rows);
  map.depth.assign(static_cast<size_t>(map.columns) * static_cast<size_t>(map.rows), kNothing);
  for (Eigen::Index i = 0; i < X.rows(); ++i) {
    const int c = static_cast<int>((X(i, 0) - map.left) / cell), r = static_cast<int>((X(i, 1) - map.bottom) / cell);
    float& d = map.depth[static_cast<size_t>(r * map.columns + c)];
    d = std::max(d, static_cast<float>(X(i, 2)));
  }
  return map;
}

struct Place {
  double misfit = std::numeric_limits<double>::infinity();
  Eigen::Vector3d plane =
      Eigen::Vector3d::Zero();  // depth difference = plane . (1, x, y), cells from the face's middle
};

// Depth differences of every `stride`-th cell of the face laid at (column, row) of the map, a plane taken off.
Place compare(const FaceRelief& face, const DepthMap& map, int column, int row, size_t stride) {
  const int centre_column = column + face.columns / 2, centre_row = row + face.rows / 2;
  if (centre_column < 0 || centre_column >= map.columns || centre_row < 0 || centre_row >= map.rows) return {};
  const float middle = map.depth[static_cast<size_t>(centre_row * map.columns + centre_column)];
  if (middle == kNothing) return {};
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0, sd = 0, sdx = 0, sdy = 0, sdd = 0;
  for (size_t i = 0; i < face.cells.size(); i += stride) {
    const FaceRelief::Cell& cell = face.cells[i];
    const int c = column + cell.column, r = row + cell.row;
    if (c < 0 || c >= map.columns || r < 0 || r >= map.rows) continue;
    const float z = map.depth[static_cast<size_t>(r * map.columns + c)];
    if (z == kNothing || std::abs(z - middle) > kDeepest) continue;
    const double d = z - cell.depth, x = cell.column - face.columns / 2, y = cell.row - face.rows / 2;
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y, syy += y * y, sd += d, sdx += d * x, sdy += d * y;
    sdd += d * d;
  }
  const double total = static_cast<double>((face.cells.size() + stride - 1) / stride);
  if (n < kLeastCover * total) return {};
  Eigen::Matrix3d A;
  A << n, sx, sy, sx, sxx, sxy, sy, sxy, syy;
  const Eigen::Vector3d b(sd, sdx, sdy);
  Place place;
  place.plane = A.ldlt().solve(b);
  const double rest = std::max(0.0, sdd - place.plane.dot(b));
  place.misfit = std::sqrt((rest + (total - n) * kMissingDepth * kMissingDepth) / total);
  return place;
}

struct Found {
  Place place;
  int column = 0, row = 0;
};

// Everywhere with every other cell, then all cells at the best few places.
Found best_place(const FaceRelief& face, const DepthMap& map) {
  if (map.depth.empty()) return {};
  std::vector<Found> rough;
  for (int r = -face.rows / 2; r < map.rows - face.rows / 2; ++r)
    for (int c = -face.columns / 2; c < map.columns - face.columns / 2; ++c)
      if (const Place place = compare(face, map, c, r, 2); std::isfinite(place.misfit)) rough.push_back({place, c, r});
  const auto better = [](const Found& a, const Found& b) { return a.place.misfit < b.place.misfit; };
  const auto few = static_cast<std::ptrdiff_t>(std::min<size_t>(40, rough.size()));
  std::partial_sort(rough.begin(), rough.begin() + few, rough.end(), better);
  Found best;
  for (auto it = rough.begin(); it != rough.begin() + few; ++it) {
    const Found exact = {compare(face, map, it->column, it->row, 1), it->column, it->row};
    if (better(exact, best)) best = exact;
  }
  return best;
}

// The pose in which the face, laid at its place, is looked at by R. The plane's slope is the rest of the rotation.
ReliefMatch pose_of(const Found& found, const FaceRelief& face, const DepthMap& map, const Eigen::Matrix3d& R) {
  const double shift_x = map.left + found.column * face.cell - face.left;
  const double shift_y = map.bottom + found.row * face.cell - face.bottom;
  ReliefMatch match;
  match.misfit = found.place.misfit;
  const double half_column = face.columns / 2 + 0.5, half_row = face.rows / 2 + 0.5;
  const Eigen::Vector3d centre(face.left + half_column * face.cell, face.bottom + half_row * face.cell, 0);
  const Eigen::Vector3d slope_normal =
      Eigen::Vector3d(-found.place.plane[1] / face.cell, -found.place.plane[2] / face.cell, 1).normalized();
  const Eigen::Matrix3d tilt =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), slope_normal).toRotationMatrix();
  const Eigen::Vector3d target = centre + Eigen::Vector3d(shift_x, shift_y, found.place.plane[0]);
  match.scan_from_face.R = R.transpose() * tilt;
  match.scan_from_face.t = R.transpose() * (target - tilt * centre);
  return match;
}

bool near(const Similarity& a, const Similarity& b) {
  const double cosine = ((a.R.transpose() * b.R).trace() - 1) / 2;
  const Eigen::Vector3d middle(0, -35, 50);  // the reference's nose
  return cosine > std::cos(25 * std::numbers::pi / 180) && (a * middle - b * middle).norm() < 30;
}

ReliefMatch look(const FaceRelief& face, const Vertices& points, const Eigen::Matrix3d& R) {
  const DepthMap map = depth_map(R, points, face.cell);
  const Found found = best_place(face, map);
  return pose_of(found, face, map, R);
}

// Looks again along the face's own axis as found, and with some more roll to either side.
ReliefMatch polish(const FaceRelief& face, const Vertices& points, const ReliefMatch& match, double roll) {
  ReliefMatch best = match;
  for (const double angle : {-roll, 0.0, roll}) {
    const Eigen::Matrix3d R = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * match.scan_from_face.R.transpose();
    const ReliefMatch again = look(face, points, R);
    if (again.misfit < best.misfit) best = again;
  }
  return best;
}

std::vector<ReliefMatch> distinct_best(std::vector<ReliefMatch> all, int count) {
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.misfit < b.misfit; });
  std::vector<ReliefMatch> best;
  for (const ReliefMatch& match : all) {
    if (static_cast<int>(best.size()) == count || !std::isfinite(match.misfit)) break;
    const auto known = [&](const ReliefMatch& other) { return near(match.scan_from_face, other.scan_from_face); };
    if (std::none_of(best.begin(), best.end(), known)) best.push_back(match);
  }
  return best;
}

}  // namespace

FaceRelief face_relief(const Vertices& face_points, double cell) {
  FaceRelief face;
  face.cell = cell;
  const DepthMap map = depth_map(Eigen::Matrix3d::Identity(), face_points, cell);
  face.columns = map.columns, face.rows = map.rows, face.left = map.left, face.bottom = map.bottom;
  for (int r = 0; r < map.rows; ++r)
    for (int c = 0; c < map.columns; ++c) {
      const float z = map.depth[static_cast<size_t>(r * map.columns + c)];
      if (z != kNothing) face.cells.push_back({c, r, z});
    }
  return face;
}

std::vector<ReliefMatch> search_relief(const FaceRelief& face, const Vertices& points, int count, int threads) {
  const std::vector<Eigen::Matrix3d> rotations = view_rotations(kRolls);
  std::vector<ReliefMatch> all(rotations.size());
  parallel_for(static_cast<int>(all.size()), threads,
               [&](int i) { all[static_cast<size_t>(i)] = look(face, points, rotations[static_cast<size_t>(i)]); });
  std::vector<ReliefMatch> best = distinct_best(all, kPolished);
  parallel_for(static_cast<int>(best.size()), threads, [&](int i) {
    ReliefMatch& match = best[static_cast<size_t>(i)];
    for (const double roll : {10.0, 5.0}) match = polish(face, points, match, roll * std::numbers::pi / 180);
  });
  return distinct_best(best, count);
}

}  // namespace facewright
