// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/nose_candidates.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "libmodel/core/topology.h"
#include "libregister/landmarking/point_grid.h"

namespace facewright {
namespace {

std::vector<bool> near_border(const Mesh& mesh, const PointGrid& grid, double reach) {
  std::vector<bool> near(static_cast<size_t>(mesh.V.rows()), false);
  const std::vector<bool> border = boundary_vertices(mesh.V.rows(), mesh.F);
  for (Eigen::Index v = 0; v < mesh.V.rows(); ++v)
    if (border[static_cast<size_t>(v)])
      for (const int j : grid.within(mesh.V.row(v), reach)) near[static_cast<size_t>(j)] = true;
  return near;
}

Dome dome_at(const Mesh& mesh, const Vertices& normals, const PointGrid& grid, Eigen::Index i, double radius) {
  Dome dome;
  const double core = 0.4 * radius;
  Eigen::Vector3d axis = Eigen::Vector3d::Zero(), top = Eigen::Vector3d::Zero();
  const std::vector<int> around = grid.within(mesh.V.row(i), radius);
  double in_core = 0;
  for (const int j : around) {
    axis += normals.row(j).transpose();
    if ((mesh.V.row(j) - mesh.V.row(i)).norm() < core) top += mesh.V.row(j).transpose(), ++in_core;
  }
  dome.axis = axis.norm() > 0 ? axis.normalized() : Eigen::Vector3d::UnitZ();
  dome.tip = top / in_core;  // the mean: a spike is no dome
  double depth = 0;
  int n = 0;
  for (const int j : around) {
    const Eigen::Vector3d d = mesh.V.row(j).transpose() - dome.tip;
    if (d.norm() < core) continue;
    depth -= d.dot(dome.axis) / d.norm();
    ++n;
  }
  dome.prominence = n > 8 ? depth / n : -1;
  return dome;
}

}  // namespace

std::vector<Dome> find_domes(const Mesh& mesh, const Vertices& normals, int count, double radius) {
  const PointGrid grid(mesh.V, radius);
  const std::vector<bool> skip = near_border(mesh, grid, 0.2 * radius);
  std::vector<Dome> all;
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i) {
    if (skip[static_cast<size_t>(i)]) continue;
    Dome dome = dome_at(mesh, normals, grid, i, radius);
    // A ball of this radius has 0.5 to 0.6; what is more is a spike.
    if (dome.prominence > 0.15 && dome.prominence < 0.75) all.push_back(dome);
  }
  std::stable_sort(all.begin(), all.end(), [](const Dome& a, const Dome& b) { return a.prominence > b.prominence; });
  std::vector<Dome> kept;
  for (const Dome& dome : all) {
    if (static_cast<int>(kept.size()) == count) break;
    const auto close = [&](const Dome& k) { return (k.tip - dome.tip).norm() < 1.5 * radius; };
    if (std::none_of(kept.begin(), kept.end(), close)) kept.push_back(dome);
  }
  return kept;
}

PolarDepth polar_depth(const Mesh& mesh, const Vertices& normals, const Dome& dome, const Eigen::Vector3d& up) {
  constexpr double kFirst = 8, kWidth = 11, kDeepest = 90;
  const Eigen::Vector3d left = up.cross(dome.axis);
  std::array<std::array<double, PolarDepth::kSectors>, PolarDepth::kRings> sum{}, n{};
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i) {
    const Eigen::Vector3d d = mesh.V.row(i).transpose() - dome.tip;
    if (normals.row(i).dot(dome.axis) <= 0 || d.dot(dome.axis) < -kDeepest) continue;
    const double x = d.dot(left), y = d.dot(up), ring = (std::hypot(x, y) - kFirst) / kWidth;
    if (ring < 0 || ring >= PolarDepth::kRings) continue;
    const double turn = std::atan2(-x, y) / (2 * std::numbers::pi);  // counter-clockwise from up
    const int sector = static_cast<int>(std::floor((turn < 0 ? turn + 1 : turn) * PolarDepth::kSectors));
    const auto r = static_cast<size_t>(ring), s = static_cast<size_t>(std::min(sector, PolarDepth::kSectors - 1));
    sum[r][s] += d.dot(dome.axis);
    n[r][s] += 1;
  }
  PolarDepth polar;
  for (size_t r = 0; r < PolarDepth::kRings; ++r)
    for (size_t s = 0; s < PolarDepth::kSectors; ++s)
      polar.depth[r][s] = n[r][s] > 0 ? sum[r][s] / n[r][s] : std::numeric_limits<double>::quiet_NaN();
  return polar;
}

std::vector<Turn> best_turns(const PolarDepth& reference, const PolarDepth& scan, int count) {
  constexpr int S = PolarDepth::kSectors;
  constexpr double kMissing = 12, kHighest = 25;  // mm: what an empty sector costs, and a wrong one at most
  std::array<double, S> mismatch{};
  for (int shift = 0; shift < S; ++shift) {
    int n = 0;
    for (int r = 0; r < PolarDepth::kRings; ++r)
      for (int s = 0; s < S; ++s) {
        const double a = reference.depth[static_cast<size_t>(r)][static_cast<size_t>(s)];
        const double b = scan.depth[static_cast<size_t>(r)][static_cast<size_t>((s + shift) % S)];
        if (std::isnan(a)) continue;
        ++n;
        mismatch[static_cast<size_t>(shift)] += std::isnan(b) ? kMissing : std::min(kHighest, std::abs(a - b));
      }
    mismatch[static_cast<size_t>(shift)] /= std::max(1, n);
  }
  std::vector<Turn> turns;
  for (int s = 0; s < S; ++s) {
    const auto at = [&](int k) { return mismatch[static_cast<size_t>((s + k + S) % S)]; };
    if (at(0) <= at(1) && at(0) < at(-1)) turns.push_back({2 * std::numbers::pi * s / S, at(0)});
  }
  std::stable_sort(turns.begin(), turns.end(), [](const Turn& a, const Turn& b) { return a.mismatch < b.mismatch; });
  if (static_cast<int>(turns.size()) > count) turns.resize(static_cast<size_t>(count));
  return turns;
}

}  // namespace facewright
