// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
//
// Prints the tables of docs/uv.md: isomap_tables [MODEL.h5]
#include <Eigen/Geometry>
#include <chrono>
#include <cstdio>

#include "libmodel/core/random.h"
#include "libmodel/model/model_file.h"
#include "libmodel/uv/disc.h"
#include "libmodel/uv/exact_geodesics.h"
#include "libmodel/uv/isomap_texture.h"
#include "libregister/reference/reference_face.h"
#include "tests/libmodel/uv/surfaces.h"
using namespace facewright;

namespace {

using facewright::testing::round_sheet;
using facewright::testing::Sheet;
using facewright::testing::sheet;

// Largest distance between uv and the plane P after the best similarity, as a share of the size of P.
double error_against(const TexCoords& uv, const Eigen::MatrixX2d& P) {
  const Eigen::MatrixX2d b = P.rowwise() - P.colwise().mean(), a = uv.rowwise() - uv.colwise().mean();
  const Eigen::Matrix2d H = a.transpose() * b;
  const Eigen::Matrix2d R =
      Eigen::Rotation2Dd(std::atan2(H(0, 1) - H(1, 0), H(0, 0) + H(1, 1))).toRotationMatrix().transpose();
  const Eigen::MatrixX2d turned = a * R;
  const double scale = turned.cwiseProduct(b).sum() / turned.squaredNorm();
  return (scale * turned - b).rowwise().norm().maxCoeff() /
         (b.colwise().maxCoeff() - b.colwise().minCoeff()).maxCoeff();
}

void print_developable(const char* name, const Sheet& s, const Eigen::MatrixX2d& plane) {
  for (const int iterations : {0, 500}) {
    IsomapOptions options;
    options.iterations = iterations;
    const IsomapResult r = isomap_uv(s.V, s.F, s.mirror, options);
    std::printf("| %s | %d | %s | %.1e | %.1e | %.5f | %.4f | %d |\n", name, static_cast<int>(s.V.rows()),
                iterations == 0 ? "scaling" : "default", error_against(r.uv, plane), r.summary.final_stress,
                r.summary.distortion.l2, r.summary.distortion.linf, r.summary.distortion.flips);
  }
}

void developable_surfaces() {
  std::printf(
      "| surface | vertices | map | largest error, of its size | stress | L2 | Linf | flips "
      "|\n|---|---|---|---|---|---|---|---|\n");
  const int m = 61, k = 13;
  const Sheet cylinder = sheet(
      m, k, [](double s, double t) { return Eigen::Vector3d(50 * std::sin(1.2 * s), 40 * t, 50 * std::cos(1.2 * s)); });
  print_developable("cylinder, 137 degrees", cylinder, cylinder.plane * Eigen::Vector2d(60, 40).asDiagonal());
  const double half_angle = std::numbers::pi / 6;
  const Sheet cone = sheet(m, k, [&](double s, double t) {
    const double along = 80 - 40 * t, r = along * std::sin(half_angle);
    return Eigen::Vector3d(r * std::sin(1.2 * s), -along * std::cos(half_angle), r * std::cos(1.2 * s));
  });
  Eigen::MatrixX2d sector(cone.V.rows(), 2);
  for (Eigen::Index v = 0; v < sector.rows(); ++v) {
    const double along = 80 - 40 * cone.plane(v, 1), a = 1.2 * std::sin(half_angle) * cone.plane(v, 0);
    sector.row(v) << along * std::sin(a), -along * std::cos(a);
  }
  print_developable("cone, half angle 30 degrees", cone, sector);
  // r = a phi from phi 4 to 10 radians, evenly by arc length.
  const auto arc = [](double phi) { return 0.5 * (phi * std::sqrt(1 + phi * phi) + std::asinh(phi)); };
  const double first = arc(4), last = arc(10);
  Sheet roll = sheet(m, k, [&](double s, double t) {
    const double target = first + 0.5 * (s + 1) * (last - first);
    double phi = 7;
    for (int i = 0; i < 50; ++i) phi -= (arc(phi) - target) / std::sqrt(1 + phi * phi);
    return Eigen::Vector3d(5 * phi * std::sin(phi), 40 * t, 5 * phi * std::cos(phi));
  });
  roll.mirror.clear();
  print_developable("Swiss roll, 344 degrees", roll,
                    roll.plane * Eigen::Vector2d(2.5 * (last - first), 40).asDiagonal());
}

// The azimuthal equidistant map of a cap: along a meridian 1, along a parallel t / sin t; by Simpson's rule.
double equidistant_l2(double angle) {
  const int n = 1000;
  double sum = 0;
  for (int i = 0; i <= n; ++i) {
    const double t = angle * i / n, ratio = t > 0 ? std::sin(t) / t : 1;
    sum += (i == 0 || i == n ? 1 : i % 2 ? 4 : 2) * 0.5 * (1 + ratio * ratio) * std::sin(t);
  }
  return std::sqrt(sum * angle / n / 3 * angle * angle / 2) / (1 - std::cos(angle));
}

void hemispheres() {
  const double angle = std::numbers::pi / 2;
  std::printf(
      "\n| hemisphere, vertices | L2, azimuthal equidistant, exact | the same on the mesh | L2, scaling | L2, default "
      "| stress, scaling | stress, default |\n|---|---|---|---|---|---|---|\n");
  for (const int rings : {4, 8, 12, 16}) {
    const Sheet s = round_sheet(rings, [&](double r, double a) {
      const double t = angle * r;
      return Eigen::Vector3d(80 * std::sin(t) * std::sin(a), 80 * std::sin(t) * std::cos(a), 80 * std::cos(t));
    });
    IsomapOptions plain;
    plain.iterations = 0;
    const IsomapSummary scaling = isomap_uv(s.V, s.F, s.mirror, plain).summary,
                        both = isomap_uv(s.V, s.F, s.mirror).summary;
    std::printf("| %d | %.4f | %.4f | %.4f | %.4f | %.4f | %.4f |\n", static_cast<int>(s.V.rows()),
                equidistant_l2(angle), measure_distortion(s.V, s.F, s.plane).l2, scaling.distortion.l2,
                both.distortion.l2, scaling.final_stress, both.final_stress);
  }
}

void print_face(const char* name, const MultiresTemplate& reference, const Vertices& mean,
                const IsomapOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const IsomapTexture t = isomap_texture(reference, mean, options);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  double linf = 0, l2 = 0, overlap = 0;
  int flips = 0;
  for (size_t l = 0; l < t.distortion.size(); ++l) {
    l2 = std::max(l2, t.distortion[l].l2), linf = std::max(linf, t.distortion[l].linf);
    overlap = std::max(overlap, t.overlap[l]), flips += t.distortion[l].flips;
  }
  const UvDistortion& d = t.distortion.back();
  std::printf("| %s | %d | %.4f | %.4f | %.2f | %.3f | %.3f | %.3f | %d | %g | %.3f | %.1f |\n", name,
              t.base.source_count, t.base.final_stress, l2, linf, d.conformal, d.area, d.symmetric_dirichlet, flips,
              overlap, t.base.coverage, seconds);
  std::fflush(stdout);
}

void face_maps(const MultiresTemplate& reference, const Vertices& mean) {
  std::printf(
      "\n| weight | sources | stress | L2, worst level | Linf | conformal | area | Dirichlet | flips, all levels | "
      "overlap | covered | seconds |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  IsomapOptions options;
  options.iterations = 0;
  print_face("scaling only", reference, mean, options);
  options.iterations = IsomapOptions{}.iterations;
  for (const double weight : {1e-5, 5e-4, 2e-3, 5e-3, 2e-2, 0.1, 0.5}) {
    options.stretch_weight = weight;
    char name[32];
    std::snprintf(name, sizeof name, "%g", weight);
    print_face(name, reference, mean, options);
  }
  options.stretch_weight = IsomapOptions{}.stretch_weight;
  options.landmark_count = 200;
  print_face("0.002", reference, mean, options);
}

// The smallest sum of squared errors that a set of points in the plane can have: majorisation from several starts.
double least_error(const Eigen::MatrixXd& D, const Eigen::MatrixX2d& near, Random& random) {
  double best = std::numeric_limits<double>::max();
  for (int start = 0; start < 5; ++start) {
    Eigen::MatrixX2d x = near;
    for (Eigen::Index i = 0; start > 0 && i < x.size(); ++i) x.data()[i] += 25 * start * random.normal();
    double error = 0;
    for (int step = 0; step < 400; ++step) {
      Eigen::MatrixX2d next = Eigen::MatrixX2d::Zero(x.rows(), 2);
      error = 0;
      for (Eigen::Index i = 0; i < x.rows(); ++i)
        for (Eigen::Index j = 0; j < i; ++j) {
          const Eigen::RowVector2d off = x.row(i) - x.row(j);
          const double length = std::max(1e-9, off.norm());
          error += 2 * (length - D(i, j)) * (length - D(i, j));
          next.row(i) += D(i, j) / length * off, next.row(j) -= D(i, j) / length * off;
        }
      x = next / static_cast<double>(x.rows());
    }
    best = std::min(best, error);
  }
  return best;
}

// No map of all vertices can do better on average over subsets than the best maps of the subsets.
void lower_bound(const MultiresTemplate& reference, const Vertices& mean) {
  const int n = reference.base_count(), size = 60, sets = 60;
  const Disc disc = close_holes(mean.topRows(n), reference.levels.front().F, {});
  std::vector<int> all(static_cast<size_t>(n));
  for (int v = 0; v < n; ++v) all[static_cast<size_t>(v)] = v;
  const Eigen::MatrixXd D = exact_geodesics(disc.V, disc.F, all).leftCols(n);
  const double scale = D.squaredNorm() / (static_cast<double>(n) * (n - 1)) * size * (size - 1);
  Random random(7);
  double sum = 0, squares = 0;
  for (int set = 0; set < sets; ++set) {
    for (int i = 0; i < size; ++i)
      std::swap(all[static_cast<size_t>(i)], all[static_cast<size_t>(i) + static_cast<size_t>(random.index(n - i))]);
    Eigen::MatrixXd part(size, size);
    Eigen::MatrixX2d near(size, 2);
    for (int i = 0; i < size; ++i) {
      near.row(i) = mean.row(all[static_cast<size_t>(i)]).head<2>();
      for (int j = 0; j < size; ++j) part(i, j) = D(all[static_cast<size_t>(i)], all[static_cast<size_t>(j)]);
    }
    const double share = least_error(part, near, random) / scale;
    sum += share / sets, squares += share * share / sets;
  }
  const double deviation = std::sqrt(std::max(0.0, squares - sum * sum) / sets);
  std::printf("\nleast stress of any map, from %d sets of %d vertices: %.4f (two standard errors less: %.4f)\n", sets,
              size, std::sqrt(sum), std::sqrt(std::max(0.0, sum - 2 * deviation)));
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  MultiresTemplate reference = default_reference();
  Vertices mean = reference.V;
  if (argc > 1) {
    const MorphableModel model = load_model(argv[1]);
    mean = model.mean(model.level_count() - 1).V;
    reference.mirror = model.mirror();
    reference.parents = model.parents();
    reference.levels.resize(1);  // a model's own levels follow its base level, which every reference face starts with
    for (int l = 0; l < model.level_count(); ++l) reference.levels.push_back({model.vertex_count(l), model.faces(l)});
    reference.V = mean;
  } else {
    developable_surfaces();
    hemispheres();
  }
  face_maps(reference, mean);
  lower_bound(reference, mean);
}
