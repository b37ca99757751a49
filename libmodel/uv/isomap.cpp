// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/uv/isomap.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/uv/disc.h"
#include "libmodel/uv/exact_geodesics.h"
#include "libmodel/uv/flattening.h"
#include "libmodel/uv/scaling.h"
#include "libmodel/uv/unfolding.h"

namespace facewright {
namespace {

constexpr int kAllUpTo = 1200;       // vertices; distances from all of them
constexpr int kSpreadSources = 300;  // above

struct Distances {
  SurfaceDistances table;
  int computed = 0;
};

// On a symmetric surface a vertex and its partner see the same distances, mirrored: half the work.
Distances measure_distances(const Disc& disc, bool symmetric, const IsomapOptions& options) {
  Distances result;
  const int count =
      options.landmark_count > 0 ? options.landmark_count : (disc.V.rows() > kAllUpTo ? kSpreadSources : 0);
  std::vector<int>& sources = result.table.sources;
  sources = spread_vertices(disc.V, symmetric ? disc.mirror : std::vector<int>{}, count);
  std::vector<int> own;
  for (int s : sources)
    if (!symmetric || s <= disc.mirror[static_cast<size_t>(s)]) own.push_back(s);
  const Eigen::MatrixXd D = exact_geodesics(
      without_needles(disc.V, disc.F, symmetric ? disc.mirror : std::vector<int>{}), disc.F, own, options.threads);
  if (!D.allFinite()) throw SolverError("uv: the shortest paths are not finite; clean the mesh of needle triangles");
  std::map<int, Eigen::Index> row_of;
  for (size_t i = 0; i < own.size(); ++i) row_of[own[i]] = static_cast<Eigen::Index>(i);
  result.computed = static_cast<int>(own.size());
  result.table.D.resize(static_cast<Eigen::Index>(sources.size()), disc.V.rows());
  for (Eigen::Index i = 0; i < result.table.D.rows(); ++i) {
    const int s = sources[static_cast<size_t>(i)];
    const auto row = row_of.find(s);
    if (row != row_of.end()) {
      result.table.D.row(i) = D.row(row->second);
      continue;
    }
    const Eigen::Index partner = row_of.at(disc.mirror[static_cast<size_t>(s)]);
    for (Eigen::Index v = 0; v < disc.V.rows(); ++v)
      result.table.D(i, v) = D(partner, disc.mirror[static_cast<size_t>(v)]);
  }
  return result;
}

// Rotation that maximises sum a_i . R b_i.
Eigen::Matrix2d best_rotation(const Eigen::MatrixX2d& a, const Eigen::MatrixX2d& b) {
  const Eigen::Matrix2d H = a.transpose() * b;
  return Eigen::Rotation2Dd(std::atan2(H(1, 0) - H(0, 1), H(0, 0) + H(1, 1))).toRotationMatrix();
}

// Faces turned towards the viewer, +y of the head up; midline vertical at u = 0 where the symmetry is known.
TexCoords upright(TexCoords uv, const Disc& disc) {
  uv.rowwise() -= uv.colwise().mean();
  if (signed_areas(uv, disc.F).cwiseSign().sum() < 0) uv.col(0) *= -1;
  const Eigen::MatrixX2d front = (disc.V.rowwise() - disc.V.colwise().mean()).leftCols<2>();
  uv = (uv * best_rotation(front, uv).transpose()).eval();
  if (disc.mirror.empty()) return uv;
  // The symmetric map nearest to this one: the mirror images of the partners, turned back onto the map.
  Eigen::MatrixX2d image(uv.rows(), 2);
  for (Eigen::Index v = 0; v < uv.rows(); ++v) image.row(v) = uv.row(disc.mirror[static_cast<size_t>(v)]);
  image.col(0) *= -1;
  const Eigen::Rotation2Dd back(Eigen::Rotation2Dd(best_rotation(Eigen::MatrixX2d(uv), image)).smallestAngle() / 2);
  return uv * back.toRotationMatrix();  // turns by minus half the angle: x -> R^T x
}

TexCoords fit_into_unit_square(const TexCoords& uv, double margin) {
  const Eigen::RowVector2d low = uv.colwise().minCoeff(), high = uv.colwise().maxCoeff();
  const double scale = (1 - 2 * margin) / (high - low).maxCoeff();
  return ((uv.rowwise() - 0.5 * (low + high)) * scale).array() + 0.5;
}

double map_size(const TexCoords& uv) { return (uv.colwise().maxCoeff() - uv.colwise().minCoeff()).maxCoeff(); }

void check(const Vertices& V, const Faces& F, const std::vector<int>& mirror, const IsomapOptions& options) {
  if (!V.allFinite()) throw InvalidInput("uv: positions hold NaN or infinity; clean the mesh first");
  if (F.rows() == 0 || F.minCoeff() < 0 || F.maxCoeff() >= V.rows())
    throw InvalidInput("uv: triangles are missing or name vertices that are not there");
  const auto n = static_cast<int>(V.rows());
  if (!mirror.empty() && static_cast<int>(mirror.size()) != n)
    throw InvalidInput("uv: the symmetry table does not have one entry per vertex");
  for (int v = 0; v < static_cast<int>(mirror.size()); ++v) {
    const int w = mirror[static_cast<size_t>(v)];
    if (w < 0 || w >= n || mirror[static_cast<size_t>(w)] != v)
      throw InvalidInput("uv: the symmetry table does not lead back to vertex " + std::to_string(v));
  }
  if (!(options.margin >= 0 && options.margin < 0.5)) throw InvalidInput("uv: margin must be within 0..0.5");
  for (const auto& [name, count] : {std::pair("landmark_count", options.landmark_count),
                                    {"repair_sweeps", options.repair_sweeps},
                                    {"iterations", options.iterations},
                                    {"threads", options.threads}})
    if (count < 0) throw InvalidInput(std::string("uv: ") + name + " must be at least 0, got " + std::to_string(count));
  if (!(options.stretch_weight > 0)) throw InvalidInput("uv: stretch_weight must be above 0");
}

// The isomap made one to one; without the symmetry if the triangles do not allow it.
UnfoldResult one_to_one(Disc& disc, const TexCoords& turned, const IsomapOptions& options, IsomapSummary* summary) {
  const TexCoords even = symmetrised(turned, disc.mirror);
  summary->asymmetry = (even - turned).norm() / std::sqrt(static_cast<double>(even.rows())) / map_size(even);
  summary->flips_before_repair = count_flips(even, disc.F);
  UnfoldResult unfolded = unfold(disc.V, disc.F, even, disc.mirror, options.repair_sweeps);
  if (!unfolded.one_to_one() && !disc.mirror.empty()) {
    disc.mirror.clear();
    unfolded = unfold(disc.V, disc.F, turned, {}, options.repair_sweeps);
  }
  summary->symmetric = !disc.mirror.empty();
  summary->repair = unfolded.method;
  return unfolded;
}

}  // namespace

IsomapResult isomap_uv(const Vertices& V, const Faces& F, const std::vector<int>& mirror,
                       const IsomapOptions& options) {
  check(V, F, mirror, options);
  Disc disc = close_holes(V, F, mirror);
  const bool symmetric = is_symmetric(disc.F, disc.mirror);
  if (symmetric) disc.V = symmetric_shape(disc.V, disc.mirror);
  const Distances distances = measure_distances(disc, symmetric, options);
  const ScalingResult scaled = landmark_scaling(distances.table.D, distances.table.sources);

  IsomapResult result;
  IsomapSummary& summary = result.summary;
  summary.options = options;
  summary.source_count = static_cast<int>(distances.table.sources.size());
  summary.computed_count = distances.computed;
  summary.third_eigenvalue_share = scaled.third_eigenvalue_share;
  summary.stress = geodesic_stress(scaled.points, distances.table, V.rows());
  UnfoldResult unfolded = one_to_one(disc, upright(scaled.points, disc), options, &summary);
  if (unfolded.one_to_one()) {
    const std::vector<int> border = boundary_loops(disc.F).front();
    const FlatteningResult flat = flatten({disc.V, disc.F, F.rows(), V.rows(), disc.mirror, border, distances.table},
                                          unfolded.uv, options.stretch_weight, options.iterations);
    unfolded.uv = flat.uv;
    summary.iterations = flat.iterations;
    summary.stop = flat.stop;
  }
  summary.final_stress = geodesic_stress(unfolded.uv, distances.table, V.rows());
  result.uv = fit_into_unit_square(unfolded.uv.topRows(V.rows()), options.margin);
  summary.distortion = measure_distortion(V, F, result.uv);
  summary.overlap = overlap_share(result.uv, F);
  summary.coverage = 0.5 * signed_areas(result.uv, F).cwiseAbs().sum();
  return result;
}

}  // namespace facewright
