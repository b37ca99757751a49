// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/uv/isomap.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "libmodel/core/errors.h"
#include "libmodel/uv/disc.h"
#include "libmodel/uv/exact_geodesics.h"
#include "libmodel/uv/relaxation.h"
#include "libmodel/uv/scaling.h"
#include "libmodel/uv/unfolding.h"

namespace facewright {
namespace {

struct Distances {
  std::vector<int> sources;
  Eigen::MatrixXd D;  // (sources x N)
  int computed = 0;
};

// On a symmetric surface a vertex and its partner see the same distances, mirrored: half the work.
Distances measure_distances(const Disc& disc, const IsomapOptions& options) {
  const bool symmetric = is_symmetric(disc.F, disc.mirror);
  const Vertices V = symmetric ? symmetric_shape(disc.V, disc.mirror) : disc.V;
  Distances result;
  result.sources = spread_vertices(V, symmetric ? disc.mirror : std::vector<int>{}, options.landmark_count);
  std::vector<int> own;
  for (int s : result.sources)
    if (!symmetric || s <= disc.mirror[static_cast<size_t>(s)]) own.push_back(s);
  const Eigen::MatrixXd D = exact_geodesics(V, disc.F, own, options.threads);
  std::map<int, Eigen::Index> row_of;
  for (size_t i = 0; i < own.size(); ++i) row_of[own[i]] = static_cast<Eigen::Index>(i);
  result.computed = static_cast<int>(own.size());
  result.D.resize(static_cast<Eigen::Index>(result.sources.size()), V.rows());
  for (Eigen::Index i = 0; i < result.D.rows(); ++i) {
    const int s = result.sources[static_cast<size_t>(i)];
    const auto row = row_of.find(s);
    if (row != row_of.end()) {
      result.D.row(i) = D.row(row->second);
      continue;
    }
    const Eigen::Index partner = row_of.at(disc.mirror[static_cast<size_t>(s)]);
    for (Eigen::Index v = 0; v < V.rows(); ++v) result.D(i, v) = D(partner, disc.mirror[static_cast<size_t>(v)]);
  }
  return result;
}

double stress_of(const TexCoords& uv, const Distances& distances) {
  double error = 0, total = 0;
  for (Eigen::Index i = 0; i < distances.D.rows(); ++i) {
    const Eigen::RowVector2d at = uv.row(distances.sources[static_cast<size_t>(i)]);
    error += ((uv.rowwise() - at).rowwise().norm().transpose() - distances.D.row(i)).squaredNorm();
    total += distances.D.row(i).squaredNorm();
  }
  return std::sqrt(error / total);
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

bool covers_once(const TexCoords& uv, const Faces& F) { return overlap_share(fit_into_unit_square(uv, 0), F) == 0; }

double map_size(const TexCoords& uv) { return (uv.colwise().maxCoeff() - uv.colwise().minCoeff()).maxCoeff(); }

}  // namespace

IsomapResult isomap_uv(const Vertices& V, const Faces& F, const std::vector<int>& mirror,
                       const IsomapOptions& options) {
  if (!V.allFinite()) throw InvalidInput("uv: positions hold NaN or infinity");
  if (!mirror.empty() && static_cast<Eigen::Index>(mirror.size()) != V.rows())
    throw InvalidInput("uv: the symmetry table does not have one entry per vertex");
  if (!(options.margin >= 0 && options.margin < 0.5)) throw InvalidInput("uv: margin must be within 0..0.5");
  const Disc disc = close_holes(V, F, mirror);
  const Distances distances = measure_distances(disc, options);
  const ScalingResult scaled = landmark_scaling(distances.D, distances.sources);

  IsomapResult result;
  IsomapSummary& summary = result.summary;
  summary.options = options;
  summary.source_count = static_cast<int>(distances.sources.size());
  summary.computed_count = distances.computed;
  summary.third_eigenvalue_share = scaled.third_eigenvalue_share;
  summary.stress = stress_of(scaled.points, distances);
  const TexCoords turned = upright(scaled.points, disc);
  const TexCoords even = symmetrised(turned, disc.mirror);
  summary.asymmetry = (even - turned).norm() / std::sqrt(static_cast<double>(even.rows())) / map_size(even);
  summary.flips_before_repair = count_flips(even, disc.F);
  UnfoldResult unfolded = unfold(disc.V, disc.F, even, disc.mirror, options.repair_sweeps);
  summary.repair = unfolded.method;
  if (unfolded.flips == 0 && options.relax_sweeps > 0) {
    const TexCoords even_stretch = relaxed(disc.V, disc.F, unfolded.uv, disc.mirror, options.relax_sweeps);
    if (covers_once(even_stretch, F) || !covers_once(unfolded.uv, F)) unfolded.uv = even_stretch;
  }
  summary.final_stress = stress_of(unfolded.uv, distances);
  result.uv = fit_into_unit_square(unfolded.uv.topRows(V.rows()), options.margin);
  summary.distortion = measure_distortion(V, F, result.uv);
  summary.overlap = overlap_share(result.uv, F);
  return result;
}

}  // namespace facewright
