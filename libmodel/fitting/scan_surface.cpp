// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/scan_surface.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/core/median.h"
#include "libmodel/core/parallel.h"
#include "libmodel/core/topology.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

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

}  // namespace

ScanSurface::ScanSurface(const Mesh& scan, int threads)
    : rows(used_points(scan)), V(scan.V(rows, Eigen::all)), tree(V), oriented(scan.F.rows() > 0) {
  if (V.rows() < 12) throw InvalidInput("fit to a scan: expected at least 12 points, got " + std::to_string(V.rows()));
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

ScanMatches match_to_scan(const ScanSurface& scan, const Vertices& V, const Vertices& N, double reach,
                          double largest_angle_deg, int threads) {
  ScanMatches out;
  const auto n = static_cast<size_t>(V.rows());
  out.state.assign(n, ScanMatch::beyond);
  out.point.assign(n, -1);
  out.distance = Eigen::VectorXd::Zero(V.rows());
  const double least = std::cos(largest_angle_deg * std::numbers::pi / 180);
  const double aside = std::max(2.5 * scan.spacing, 1e-9);
  parallel_blocks(static_cast<int>(n), threads, [&](int first, int last) {
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
        out.state[k] = ScanMatch::turned;
      else if (scan.at_rim[static_cast<size_t>(row)] || (d - along * normal).norm() > aside + 0.3 * std::abs(along))
        out.state[k] = ScanMatch::at_rim;
      else
        out.state[k] = ScanMatch::counts;
    }
  });
  return out;
}

double trim(ScanMatches& m, double share) {
  std::vector<double> size;
  for (size_t k = 0; k < m.state.size(); ++k)
    if (m.state[k] == ScanMatch::counts) size.push_back(std::abs(m.distance[static_cast<Eigen::Index>(k)]));
  if (size.empty()) return 0;
  std::vector<double> sorted = size;
  const double median = median_of(sorted);
  std::sort(sorted.begin(), sorted.end());
  const double limit =
      sorted[std::min(sorted.size() - 1, static_cast<size_t>((1 - share) * static_cast<double>(sorted.size())))];
  for (size_t k = 0; k < m.state.size(); ++k)
    if (m.state[k] == ScanMatch::counts && std::abs(m.distance[static_cast<Eigen::Index>(k)]) > limit)
      m.state[k] = ScanMatch::trimmed;
  return 1.4826 * median;
}

std::string to_string(ScanMatch match) {
  switch (match) {
    case ScanMatch::counts:
      return "matched";
    case ScanMatch::beyond:
      return "nothing near";
    case ScanMatch::at_rim:
      return "at a border";
    case ScanMatch::turned:
      return "turned away";
    case ScanMatch::trimmed:
      return "trimmed";
  }
  return "unknown";
}

}  // namespace facewright
